/* Tasks take turns in one thread each: a tick passes when all of them sleep, so that a run is the same every time. */
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "queue.h"
#include "task.h"

enum { MOST = 8 };

struct mailbox {
    bool full;
    size_t size;
    unsigned char item[64];
};

typedef struct {
    void (*code)(void *);
    void *parameter;
    TickType_t wakes;
    bool ended;
    pthread_t thread;
} thread_t;

static thread_t tasks[MOST];
static size_t count, turn;
static TickType_t now;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t turned = PTHREAD_COND_INITIALIZER;

/* Gives the turn to the task that wakes first. */
static void pass(void)
{
    size_t next = MOST;
    for (size_t at = 0; at < count; at++) {
        if (!tasks[at].ended && ((next == MOST) || (tasks[at].wakes < tasks[next].wakes))) {
            next = at;
        }
    }
    turn = next;
    now = ((next < MOST) && (tasks[next].wakes > now)) ? tasks[next].wakes : now;
    (void)pthread_cond_broadcast(&turned);
}

static void *run(void *task)
{
    const size_t own = (size_t)((thread_t *)task - tasks);
    (void)pthread_mutex_lock(&lock);
    while (turn != own) {
        (void)pthread_cond_wait(&turned, &lock);
    }
    tasks[own].code(tasks[own].parameter);
    (void)pthread_mutex_unlock(&lock);
    return NULL;
}

BaseType_t xTaskCreate(void (*code)(void *), const char *name, uint16_t stack, void *parameter, UBaseType_t priority,
        TaskHandle_t *made)
{
    (void)name;
    (void)stack;
    (void)priority;
    (void)made;
    if (count == MOST) {
        return pdFALSE;
    }
    tasks[count].code = code;
    tasks[count].parameter = parameter;
    count = count + 1u;
    return pdPASS;
}

void vTaskStartScheduler(void)
{
    turn = MOST;
    for (size_t at = 0; at < count; at++) {
        (void)pthread_create(&tasks[at].thread, NULL, run, &tasks[at]);
    }
    (void)pthread_mutex_lock(&lock);
    pass();
    (void)pthread_mutex_unlock(&lock);
    for (size_t at = 0; at < count; at++) {
        (void)pthread_join(tasks[at].thread, NULL);
    }
}

void vTaskDelete(TaskHandle_t task)
{
    (void)task; /* the caller itself, which returns after this */
    tasks[turn].ended = true;
    pass();
}

TickType_t xTaskGetTickCount(void)
{
    return now;
}

BaseType_t xTaskDelayUntil(TickType_t *woken, TickType_t period)
{
    const size_t own = turn;
    *woken = *woken + period;
    tasks[own].wakes = *woken;
    pass();
    while (turn != own) {
        (void)pthread_cond_wait(&turned, &lock);
    }
    return pdTRUE;
}

QueueHandle_t xQueueCreate(UBaseType_t length, UBaseType_t size)
{
    struct mailbox *made = calloc(1, sizeof *made);
    (void)length;
    if ((made == NULL) || (size > sizeof made->item)) {
        abort();
    }
    made->size = size;
    return made;
}

BaseType_t xQueueOverwrite(QueueHandle_t queue, const void *item)
{
    (void)memcpy(queue->item, item, queue->size);
    queue->full = true;
    return pdPASS;
}

BaseType_t xQueuePeek(QueueHandle_t queue, void *item, TickType_t wait)
{
    (void)wait;
    if (queue->full) {
        (void)memcpy(item, queue->item, queue->size);
    }
    return queue->full ? pdTRUE : pdFALSE;
}
