#ifndef SHIM_TASK_H
#define SHIM_TASK_H

#include "FreeRTOS.h"

typedef void *TaskHandle_t;
BaseType_t xTaskCreate(void (*code)(void *), const char *name, uint16_t stack, void *parameter, UBaseType_t priority,
        TaskHandle_t *made);
void vTaskStartScheduler(void); /* here it returns when every task has deleted itself */
void vTaskDelete(TaskHandle_t task);
TickType_t xTaskGetTickCount(void);
BaseType_t xTaskDelayUntil(TickType_t *woken, TickType_t period);

#endif
