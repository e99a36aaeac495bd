/* Common parts of both examples: a simulated material instead of a scanner, recipes, and output. */

#ifndef EXAMPLE_H
#define EXAMPLE_H

#include <string.h>

#include "glimpse.h"

/* Defined in host.c or board.c. */
void print(const char *text);

/* Defined in recipes.S; firmware usually has one recipe. */
extern const uint8_t phong_begin[], phong_end[];
extern const uint8_t cook_torrance_begin[], cook_torrance_end[];
extern const uint8_t neural_begin[], neural_end[];
extern const uint8_t linear_begin[], linear_end[];
extern const uint8_t completed_begin[], completed_end[];

static const struct {
    const char *name;
    const uint8_t *begin, *end;
} RECIPES[] = {
    {"phong", phong_begin, phong_end},
    {"cook-torrance", cook_torrance_begin, cook_torrance_end},
    {"neural", neural_begin, neural_end},
    {"linear", linear_begin, linear_end},
    /* Neural, with a recipe that completes the readings. */
    {"neural-completed", completed_begin, completed_end},
};
#define RECIPE_COUNT (sizeof RECIPES / sizeof RECIPES[0])
/* Words of the largest recipe, as printed by trainer inspect completed/neural-n8.recipe. */
#define RECIPE_WORDS 2396

static inline float lobe(float sharpness, float theta_h)
{
    float falloff = 1.0f + sharpness * theta_h * theta_h;
    return 1.0f / (falloff * falloff);
}

/* Returns the reading of the simulated material: a diffuse color, and a highlight of two widths. It uses
   only sums, products and quotients, which every machine rounds identically. A scanner would instead move
   its arms to sample->directions, read its sensor, and divide the counts by those of a white tile. */
static inline glimpse_reading read_sensor(const glimpse_sample *sample)
{
    float lobes = (8.0f * lobe(40.0f, sample->theta_h) + lobe(0.1f * 40.0f, sample->theta_h)) / 9.0f;
    float grazing = 1.0f + 0.2f * sample->theta_d * sample->theta_d;
    float highlight = 0.9f * lobes * grazing;
    glimpse_reading reading = {
        .brdf = {0.12f + highlight, 0.05f + highlight, 0.03f + 0.9f * highlight},
        .saturated = 0,
    };
    return reading;
}

/* Prints the bits of a number as hexadecimal digits, and a space. */
static inline void print_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    char text[10] = "00000000 ";
    for (int digit = 0; digit < 8; digit++)
        text[digit] = "0123456789abcdef"[bits >> (28 - 4 * digit) & 15];
    print(text);
}

/* Prints all values of a fitted material on a line. */
static inline glimpse_status print_values(const char *name, const glimpse_scan *scan)
{
    static float values[675]; /* enough for the largest model */
    size_t count = 0;
    glimpse_status status =
        glimpse_fitted_values(scan, values, sizeof values / sizeof values[0], &count);
    if (status != GLIMPSE_STATUS_OK) return status;
    print(name);
    print(".values=");
    for (size_t i = 0; i < count; i++) print_bits(values[i]);
    print("\n");
    return status;
}

/* Prints the text of a status. */
static inline int fail(const char *name, glimpse_status status)
{
    print(name);
    print(": ");
    print(glimpse_status_text(status));
    print("\n");
    return 1;
}

#endif
