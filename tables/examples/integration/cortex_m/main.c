/* The guarded approach on a bare Cortex-M: a main loop that SysTick wakes, and a state that outlives a reset.
 *
 * The interrupt only counts ticks and takes readings; the loop copies them while interrupts are off, runs one step, and gives the
 * outputs. The board is QEMU's mps2-an385; here the arm is a few lines of arithmetic, so that the example ends by itself. */
#include "approach.h"

/* cppcheck-suppress-begin misra-c2012-11.4 ; registers of the device stand at fixed addresses */
#define UART_DATA (*(volatile uint32_t *)0x40004000u)
#define UART_CONTROL (*(volatile uint32_t *)0x40004008u)
#define SYSTICK ((volatile uint32_t *)0xE000E010u)
#define RESET (*(volatile uint32_t *)0xE000ED0Cu)
/* cppcheck-suppress-end misra-c2012-11.4 */
#define CYCLES_PER_TICK 1000000u /* 40 ms at 25 MHz */

/* Not cleared at start-up (see mps2.ld): after a reset the step goes on where it was, if the state is one of these tables'. */
static approach_t state __attribute__((section(".noinit")));

static struct {
    uint16_t distance_mm;
    double force_n;
} reading = { 2000u, 0.5 }; /* what the interrupt has read last */
static volatile uint32_t ticks;

void systick(void); /* in the table of vectors */

void systick(void)
{
    const uint16_t travelled_mm = (uint16_t)(state.speed_mm_s / 25u); /* a driver reads a sensor here */
    if (reading.distance_mm > travelled_mm) {
        reading.distance_mm = (uint16_t)(reading.distance_mm - travelled_mm);
    } else {
        reading.distance_mm = 0u;
    }
    ticks = ticks + 1u;
}

static void print(const char *text)
{
    for (uint32_t at = 0u; text[at] != '\0'; at++) {
        UART_DATA = (uint32_t)text[at];
    }
}

/* All assembly stands in these three. It is an extension of the language, and the checker takes it for calls. */
/* cppcheck-suppress-begin misra-c2012-17.3 */
static void interrupts_off(void)
{
    __asm volatile("cpsid i" ::: "memory");
}

static void interrupts_on(void)
{
    __asm volatile("cpsie i" ::: "memory");
}

static void wait_for_interrupt(void)
{
    __asm volatile("wfi");
}
/* cppcheck-suppress-end misra-c2012-17.3 */

/* One cycle. Interrupts are off only while the inputs are copied: a step works on its own state, so that no reading changes under it. */
static int32_t cycle(void)
{
    interrupts_off();
    state.distance_mm = reading.distance_mm;
    state.force_n = reading.force_n;
    interrupts_on();
    state.braking_mm = 250u;
    return approach_approach_step(&state);
}

int main(void)
{
    int32_t status = 0;
    uint32_t done = 0u;
    const bool kept = approach_check(&state) == APPROACH_CHECK_OK;
    UART_CONTROL = 1u; /* transmit */
    if (kept) {
        reading.distance_mm = state.distance_mm; /* the simulated arm stands where it stood */
        print("goes on\n");
    } else { /* the first start, or other tables than before */
        approach_init(&state);
        print("begins\n");
    }
    SYSTICK[1] = CYCLES_PER_TICK - 1u;
    SYSTICK[2] = 0u;
    SYSTICK[0] = 7u; /* the processor's clock, interrupt, on */
    while ((status == 0) && ((state.status_report != EXM_WRDS_1984_LVL_STS_DONE) || (state.settled < 3u))) {
        wait_for_interrupt();
        if (done == ticks) {
            continue; /* another interrupt woke it */
        }
        done = done + 1u;
        if (done != ticks) {
            print("late\n"); /* a cycle took longer than its period */
            done = ticks;
        }
        if (cycle() != APPROACH_FAULT_NONE) {
            print("fault\n"); /* `state.fault` and `state.fault_at` say which; stop the arm here */
            status = 1;
        } else if (!kept && (state.distance_mm < 1000u)) {
            RESET = 0x05FA0004u; /* as a watchdog would, once, to show that the state is kept */
        } else {
            /* the arm goes on */
        }
    }
    if (status == 0) {
        print("arrived\n");
    }
    return status;
}
