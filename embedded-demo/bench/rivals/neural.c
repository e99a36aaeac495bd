/* For comparison: the same fit in straightforward C. 20 steps of SGD on 8 samples with the network of 675 parameters,
   and with the loss and the step sizes of Glimpse. `cargo run -p glimpse-tests --example rivals`
   compiles it and counts its instructions. */

#include <math.h>
#include <stdint.h>

#include "numbers.h" /* INITIAL, STEP_SIZES of the recipe; INPUTS, MEASURED of the material */

#define HIDDEN 21
#define STEPS 20

typedef struct {
    float fc1[6][HIDDEN], b1[HIDDEN];
    float fc2[HIDDEN][HIDDEN], b2[HIDDEN];
    float fc3[HIDDEN][3], b3[3];
} Parameters;

#define COUNT (sizeof(Parameters) / sizeof(float))

static Parameters parameters, gradient;

static float sign(float x) { return (float)((x > 0.0f) - (x < 0.0f)); }

/* Adds the gradient of weight * sum over channels of |ln(1 + y c) - ln(1 + f c)|. */
static void accumulate(const float x[6], const float y[3], float weight)
{
    const Parameters *p = &parameters;
    Parameters *g = &gradient;
    float h1[HIDDEN], h2[HIDDEN], by_h1[HIDDEN], by_h2[HIDDEN], by_z[3];

    for (int j = 0; j < HIDDEN; j++) {
        float sum = p->b1[j];
        for (int i = 0; i < 6; i++) sum += x[i] * p->fc1[i][j];
        h1[j] = sum > 0.0f ? sum : 0.0f;
    }
    for (int j = 0; j < HIDDEN; j++) {
        float sum = p->b2[j];
        for (int i = 0; i < HIDDEN; i++) sum += h1[i] * p->fc2[i][j];
        h2[j] = sum > 0.0f ? sum : 0.0f;
    }
    float cosine = x[2] * x[5] - x[0] * x[3];
    if (cosine < 0.0f) cosine = 0.0f;
    for (int k = 0; k < 3; k++) {
        float z = p->b3[k];
        for (int i = 0; i < HIDDEN; i++) z += h2[i] * p->fc3[i][k];
        float f = expf(z) - 1.0f;
        if (f <= 0.0f) f = 0.0f;
        float shifted = 1.0f + f * cosine;
        float slope = sign(shifted - (1.0f + y[k] * cosine)) * weight / shifted * cosine;
        by_z[k] = f > 0.0f ? slope * (f + 1.0f) : 0.0f;
    }
    for (int i = 0; i < HIDDEN; i++) {
        float sum = 0.0f;
        for (int k = 0; k < 3; k++) {
            g->fc3[i][k] += h2[i] * by_z[k];
            sum += p->fc3[i][k] * by_z[k];
        }
        by_h2[i] = h2[i] > 0.0f ? sum : 0.0f;
    }
    for (int k = 0; k < 3; k++) g->b3[k] += by_z[k];
    for (int i = 0; i < HIDDEN; i++) {
        float sum = 0.0f;
        for (int j = 0; j < HIDDEN; j++) {
            g->fc2[i][j] += h1[i] * by_h2[j];
            sum += p->fc2[i][j] * by_h2[j];
        }
        by_h1[i] = h1[i] > 0.0f ? sum : 0.0f;
    }
    for (int j = 0; j < HIDDEN; j++) g->b2[j] += by_h2[j];
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < HIDDEN; j++) g->fc1[i][j] += x[i] * by_h1[j];
    for (int j = 0; j < HIDDEN; j++) g->b1[j] += by_h1[j];
}

static void fit(void)
{
    float *p = (float *)&parameters, *g = (float *)&gradient;
    for (unsigned i = 0; i < COUNT; i++) p[i] = INITIAL[i];
    for (int step = 0; step < STEPS; step++) {
        for (unsigned i = 0; i < COUNT; i++) g[i] = 0.0f;
        for (int sample = 0; sample < SAMPLES; sample++)
            accumulate(INPUTS[sample], MEASURED[sample], 1.0f / (3.0f * SAMPLES));
        for (unsigned i = 0; i < COUNT; i++) p[i] -= STEP_SIZES[i] * g[i];
    }
}

/* Its address marks the begin and the end of the fit in an instruction trace. */
__attribute__((noinline)) void counter_now(void) { __asm__ volatile("nop"); }

static int semihosting(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

/* Prints to the standard output, which is opened as ":tt" for writing. */
static void print(const char *text)
{
    const void *open[3] = {":tt", (void *)4, (void *)3};
    int output = semihosting(0x01, open);
    unsigned length = 0;
    while (text[length] != 0) length++;
    const void *write[3] = {(void *)output, text, (void *)length};
    semihosting(0x05, write);
    semihosting(0x02, &output); /* close */
}

int main(void)
{
    counter_now();
    fit();
    counter_now();
    print("parameters=");
    for (unsigned i = 0; i < COUNT; i++) {
        union { float value; uint32_t bits; } number = {.value = ((float *)&parameters)[i]};
        char digits[10] = {0};
        for (int digit = 0; digit < 8; digit++)
            digits[digit] = "0123456789abcdef"[number.bits >> (28 - 4 * digit) & 15];
        digits[8] = ' ';
        print(digits);
    }
    print("\n");
    semihosting(0x18, (void *)0x20026); /* exit code 0 */
    for (;;) {}
}

void reset(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* turns the floating-point unit on */
    __asm__ volatile("dsb\n\tisb");
    main();
}

extern uint32_t stack_top;
__attribute__((section(".vectors"), used)) const void *const VECTORS[2] = {&stack_top, (void *)reset};
