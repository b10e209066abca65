/* The least start-up: vectors, data, bss, and an end by semihosting, which leaves QEMU with main's status. */
#include <stdint.h>

/* Places that the linker script names; how many words are between them is for it to say. */
/* cppcheck-suppress-begin misra-c2012-8.11 ; their lengths are known to the linker alone */
extern uint32_t data_start[];
extern uint32_t data_end[];
extern const uint32_t data_load[];
extern uint32_t bss_start[];
extern uint32_t bss_end[];
extern uint32_t stack_top[];
/* cppcheck-suppress-end misra-c2012-8.11 */

int main(void);
void systick(void);
void reset(void);

/* All assembly stands here. The checker takes it for a call, and does not see what it uses. */
/* cppcheck-suppress misra-c2012-2.7 */
static void stop(uint32_t reason)
{
    /* cppcheck-suppress misra-c2012-17.3 */
    __asm volatile("mov r1, %0\n\tmovs r0, #0x18\n\tbkpt 0xAB" : : "r"(reason) : "r0", "r1", "memory"); /* 0x18: SYS_EXIT */
    for (;;) {
    }
}

static void hard_fault(void)
{
    stop(0x20024u); /* a run-time error */
}

static uint32_t words_between(const uint32_t *from, const uint32_t *to)
{
    /* cppcheck-suppress misra-c2012-11.4 ; to the language the linker's places are two objects, which have no distance */
    return ((uint32_t)to - (uint32_t)from) / (uint32_t)sizeof(uint32_t);
}

void reset(void)
{
    const uint32_t copied = words_between(data_start, data_end);
    const uint32_t cleared = words_between(bss_start, bss_end);
    for (uint32_t at = 0u; at < copied; at++) {
        data_start[at] = data_load[at];
    }
    for (uint32_t at = 0u; at < cleared; at++) {
        bss_start[at] = 0u;
    }
    stop((main() == 0) ? 0x20026u : 0x20024u); /* ended as it should, or not */
}

/* Attributes are an extension of the language (1.2): what the processor reads at address 0 stands in a section of its own. */
/* cppcheck-suppress-begin unusedStructMember */
__attribute__((section(".vectors"), used)) static const struct {
    const uint32_t *stack;
    void (*handlers[15])(void);
/* cppcheck-suppress-end unusedStructMember */
} vectors = {
    stack_top,
    { reset, hard_fault, hard_fault, hard_fault, hard_fault, hard_fault, hard_fault, hard_fault, hard_fault, hard_fault,
        hard_fault, hard_fault, hard_fault, hard_fault, systick },
};
