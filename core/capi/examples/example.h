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
/* Words of the largest recipe, completed/neural-n8.recipe, as printed by trainer inspect. */
#define RECIPE_WORDS 2211

static inline float lobe(float sharpness, float squared_sine)
{
    float falloff = 1.0f + sharpness * squared_sine;
    return 1.0f / (falloff * falloff);
}

/* Dark and white counts. The white was read once, with the light along its normal, and the light's spot is the
   larger one. */
static const glimpse_calibration CALIBRATION = {
    .dark = {100, 100, 100},
    .white = {3000, 3000, 3000},
    .reflectance = {0.99f, 0.99f, 0.99f},
    .saturation = 32767,
    .footprint = GLIMPSE_FOOTPRINT_LIGHT_LARGER,
    .reference = {{0, 0, 1}, {0.6f, 0, 0.8f}},
};

/* Reads the simulated material twice: a diffuse color, and a highlight of two widths. It uses only sums, products
   and quotients, which every machine rounds identically. A scanner would instead move its arms to these directions,
   switch its lamp on or off, and read its sensor. */
static inline glimpse_status read_sensor(const glimpse_directions *at, int is_lit, glimpse_reading *reading)
{
    float half[3];
    for (int i = 0; i < 3; i++) half[i] = at->incoming[i] + at->outgoing[i];
    float across = half[0] * half[0] + half[1] * half[1], squared = across + half[2] * half[2];
    float from_normal = across / squared; /* squared sine of theta_h */
    float lobes = (8.0f * lobe(40.0f, from_normal) + lobe(0.1f * 40.0f, from_normal)) / 9.0f;
    float grazing = 1.0f + 0.2f * (1.0f - 0.25f * squared); /* squared sine of theta_d */
    float highlight = 0.9f * lobes * grazing;
    float light = is_lit ? 9000.0f * at->incoming[2] : 0.0f;
    float brdf[3] = {0.12f + highlight, 0.05f + highlight, 0.03f + 0.9f * highlight};
    glimpse_repeated repeated = {0};
    glimpse_status status = GLIMPSE_STATUS_OK;
    for (int time = 0; time < 2 && status == GLIMPSE_STATUS_OK; time++) {
        float counts[3];
        for (int channel = 0; channel < 3; channel++)
            counts[channel] = 100.0f + (float)time + light * brdf[channel];
        status = glimpse_repeated_add(&repeated, counts, 0);
    }
    if (status != GLIMPSE_STATUS_OK) return status;
    return glimpse_calibrate(&CALIBRATION, repeated.mean, at, reading);
}

/* A flash in RAM. */
static inline int read_flash(void *flash, uint32_t offset, uint8_t *bytes, size_t count)
{
    memcpy(bytes, (uint8_t *)flash + offset, count);
    return 0;
}

static inline int erase_flash(void *flash, uint32_t from, uint32_t to)
{
    memset((uint8_t *)flash + from, 0xFF, to - from);
    return 0;
}

static inline int write_flash(void *flash, uint32_t offset, const uint8_t *bytes, size_t count)
{
    memcpy((uint8_t *)flash + offset, bytes, count);
    return 0;
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

/* Prints a number on a line. */
static inline void print_number(const char *name, const char *quantity, float value)
{
    print(name);
    print(quantity);
    print_bits(value);
    print("\n");
}

/* Prints the quality of a fitted material, and its BRDF in the mirror direction. Linear needs a basis for it. */
static inline glimpse_status print_fitted(const char *name, const glimpse_scan *scan)
{
    static const glimpse_directions MIRROR = {{0.6f, 0.0f, 0.8f}, {-0.6f, 0.0f, 0.8f}};
    glimpse_fitted fitted;
    float brdf[3];
    glimpse_status status = glimpse_fitted_describe(scan, &fitted);
    if (status != GLIMPSE_STATUS_OK) return status;
    print_number(name, ".mean=", fitted.residual.mean);
    print_number(name, ".worst=", fitted.residual.worst);
    print_number(name, ".predicted=", fitted.predicted_loss);
    status = glimpse_fitted_brdf(scan, &MIRROR, &brdf);
    if (status == GLIMPSE_STATUS_NO_BASIS) return GLIMPSE_STATUS_OK;
    if (status != GLIMPSE_STATUS_OK) return status;
    print(name);
    print(".brdf=");
    for (int channel = 0; channel < 3; channel++) print_bits(brdf[channel]);
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
