/* The least start-up: vectors, data, bss, and an end by semihosting, which leaves QEMU with main's status. */
#include <stdint.h>

extern uint32_t data_start, data_end, data_load, bss_start, bss_end, stack_top;
int main(void);
void systick(void);
void reset(void);

static void stop(uint32_t reason)
{
    register uint32_t operation __asm("r0") = 0x18u; /* SYS_EXIT */
    register uint32_t parameter __asm("r1") = reason;
    __asm volatile("bkpt 0xAB" : : "r"(operation), "r"(parameter) : "memory");
    for (;;) {
    }
}

static void hard_fault(void)
{
    stop(0x20024u); /* a run-time error */
}

void reset(void)
{
    const uint32_t *from = &data_load;
    for (uint32_t *to = &data_start; to < &data_end; to++) {
        *to = *from++;
    }
    for (uint32_t *to = &bss_start; to < &bss_end; to++) {
        *to = 0u;
    }
    stop((main() == 0) ? 0x20026u : 0x20024u); /* ended as it should, or not */
}

__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    (void (*)(void))&stack_top, reset, hard_fault, hard_fault, hard_fault, hard_fault, hard_fault, 0,
    0, 0, 0, hard_fault, hard_fault, 0, hard_fault, systick,
};
