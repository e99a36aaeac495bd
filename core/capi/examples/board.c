/* Start-up code for a Cortex-M in QEMU, with output over semihosting. */

#include "example.h"

int main(void);
void reset(void);
void fault(void);
extern uint32_t stack_top, data_begin, data_end, data_source, bss_begin, bss_end;

__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*handlers[3])(void);
} VECTORS = {&stack_top, {reset, fault, fault}};

static int semihosting(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

/* Prints to the standard output, which the first call opens as ":tt" for writing. */
void print(const char *text)
{
    static int output = -1;
    if (output < 0) {
        const void *open[3] = {":tt", (const void *)4, (const void *)3};
        output = semihosting(0x01, open);
    }
    const void *write[3] = {(const void *)output, text, (const void *)strlen(text)};
    semihosting(0x05, write);
}

/* Ends QEMU with this exit code. */
static void end(int code)
{
    const void *exit[2] = {(const void *)0x20026, (const void *)code};
    semihosting(0x20, exit);
    for (;;) {}
}

void reset(void)
{
#ifdef __ARM_FP
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* turns the floating-point unit on */
    __asm__ volatile("dsb\n isb");
#endif
    const uint32_t *source = &data_source;
    for (volatile uint32_t *to = &data_begin; to < &data_end; to++) *to = *source++;
    for (volatile uint32_t *to = &bss_begin; to < &bss_end; to++) *to = 0;
    end(main());
}

void fault(void)
{
    end(2);
}
