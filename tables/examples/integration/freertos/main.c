/* The guarded approach as a task of FreeRTOS: readings and commands go through mailboxes, so that the state has one owner and no lock.
 *
 * Zephyr's words for the same: k_thread_create, k_timer or k_msleep, and k_msgq of one message with K_NO_WAIT. The folder `shim` has just
 * enough of the API for a PC; a target has FreeRTOS's own headers in its place. */
#include <stdio.h>

#include "FreeRTOS.h"
#include "queue.h"
#include "task.h"

#include "approach.h"

typedef struct {
    uint16_t distance_mm;
    double force_n;
} reading_t;

typedef struct {
    uint16_t speed_mm_s;
    bool ended;
} command_t;

static QueueHandle_t readings; /* of one element each: the latest is what counts */
static QueueHandle_t commands;

/* The step, every 40 ms. Nobody else touches `state`: other tasks, and interrupts, see what goes into the mailboxes. */
static void control(void *unused)
{
    static approach_t state; /* static, or global: the task's stack stays small */
    TickType_t woken = xTaskGetTickCount();
    command_t command = { 0u, false };
    (void)unused;
    approach_init(&state);
    while (!command.ended) {
        reading_t reading;
        if (xQueuePeek(readings, &reading, 0) == pdTRUE) {
            state.distance_mm = reading.distance_mm;
            state.force_n = reading.force_n;
        } /* else the inputs stay as they are: a reading that stays away too long is an input of its own */
        state.braking_mm = 250u;
        if (approach_approach_step(&state) != APPROACH_FAULT_NONE) {
            /* cppcheck-suppress misra-c2012-21.6 ; on a PC; a target has its own log */
            (void)printf("fault %d at %d\n", (int)state.fault, (int)state.fault_at);
            state.speed_mm_s = 0u; /* an output without a `safe` value keeps what it had */
            command.ended = true;
        }
        command.ended = command.ended || (state.settled == 3u);
        command.speed_mm_s = state.speed_mm_s;
        (void)xQueueOverwrite(commands, &command);
        (void)xTaskDelayUntil(&woken, pdMS_TO_TICKS(40));
    }
    vTaskDelete(NULL);
}

/* The arm, simulated: on a target a driver, which may as well be an interrupt (xQueueOverwriteFromISR). */
static void drive(void *unused)
{
    reading_t reading = { 2000u, 0.5 };
    command_t command = { 0u, false };
    TickType_t woken = xTaskGetTickCount();
    (void)unused;
    while (!command.ended) {
        (void)xQueueOverwrite(readings, &reading);
        (void)xTaskDelayUntil(&woken, pdMS_TO_TICKS(40));
        if (xQueuePeek(commands, &command, 0) == pdTRUE) {
            const uint16_t travelled_mm = (uint16_t)(command.speed_mm_s / 25u);
            reading.distance_mm = (uint16_t)(reading.distance_mm - ((reading.distance_mm < travelled_mm) ? reading.distance_mm : travelled_mm));
        }
    }
    /* cppcheck-suppress misra-c2012-21.6 ; on a PC */
    (void)printf("arrived, %u mm left\n", (unsigned)reading.distance_mm);
    vTaskDelete(NULL);
}

int main(void)
{
    readings = xQueueCreate(1, sizeof(reading_t));
    commands = xQueueCreate(1, sizeof(command_t));
    (void)xTaskCreate(control, "control", 256, NULL, 2, NULL);
    (void)xTaskCreate(drive, "drive", 256, NULL, 1, NULL);
    vTaskStartScheduler();
    return 0;
}
