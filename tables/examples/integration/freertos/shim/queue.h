#ifndef SHIM_QUEUE_H
#define SHIM_QUEUE_H

#include "FreeRTOS.h"

typedef struct mailbox *QueueHandle_t;
QueueHandle_t xQueueCreate(UBaseType_t length, UBaseType_t size); /* here of length 1 */
BaseType_t xQueueOverwrite(QueueHandle_t queue, const void *item);
BaseType_t xQueuePeek(QueueHandle_t queue, void *item, TickType_t wait); /* here it does not wait */

#endif
