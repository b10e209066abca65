/* Just enough of FreeRTOS's API to build and run the example on a PC, over POSIX threads; not for a target. */
#ifndef SHIM_FREERTOS_H
#define SHIM_FREERTOS_H

#include <stddef.h>
#include <stdint.h>

typedef long BaseType_t;
typedef unsigned long UBaseType_t;
typedef uint32_t TickType_t;
#define pdTRUE ((BaseType_t)1)
#define pdFALSE ((BaseType_t)0)
#define pdPASS pdTRUE
#define pdMS_TO_TICKS(ms) ((TickType_t)(ms))

#endif
