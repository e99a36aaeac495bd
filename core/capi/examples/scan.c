/* Scans a material with each recipe, step by step. The same file is compiled for a host and for
   microcontrollers. */

#include "example.h"

/* Memory of a scan, reused by the next one. */
static GLIMPSE_MEMORY(memory, GLIMPSE_SCAN_BYTES(RECIPE_WORDS));

static glimpse_status scan_material(const char *name, const uint8_t *recipe, size_t recipe_bytes)
{
    glimpse_scan *scan;
    glimpse_status status =
        glimpse_scan_begin(memory, sizeof memory, recipe, recipe_bytes, &scan);
    if (status != GLIMPSE_STATUS_OK) return status;

    /* Samples may be read in any order. This example follows the recipe's order. */
    glimpse_sample sample;
    while (glimpse_scan_next(scan, 0, &sample) == GLIMPSE_STATUS_OK) {
        glimpse_reading reading = read_sensor(&sample);
        status = glimpse_scan_record(scan, sample.index, &reading, NULL);
        if (status != GLIMPSE_STATUS_OK) return status;
    }

    status = glimpse_fit_begin(scan);
    glimpse_progress progress = {0, 1};
    while (status == GLIMPSE_STATUS_OK && progress.done < progress.total)
        status = glimpse_fit_advance(scan, 8, &progress); /* service motors and watchdog here */
    if (status != GLIMPSE_STATUS_OK) return status;

    /* An implausible material (status 84 to 91) also has a residual and values. This example treats it as a failure. */
    glimpse_residual residual;
    status = glimpse_fit_finish(scan, &residual);
    if (status != GLIMPSE_STATUS_OK) return status;
    print(name);
    print(".residual=");
    print_bits(residual.mean);
    print_bits(residual.worst);
    print("\n");

    /* Evaluate the BRDF at other directions. Linear needs a basis for it. */
    static const glimpse_directions MIRROR = {{0.6f, 0.0f, 0.8f}, {-0.6f, 0.0f, 0.8f}};
    float brdf[3];
    status = glimpse_fitted_brdf(scan, &MIRROR, &brdf);
    if (status == GLIMPSE_STATUS_OK) {
        print(name);
        print(".brdf=");
        for (int channel = 0; channel < 3; channel++) print_bits(brdf[channel]);
        print("\n");
    } else if (status != GLIMPSE_STATUS_NO_BASIS) {
        return status;
    }
    return print_values(name, scan);
}

int main(void)
{
    for (size_t i = 0; i < RECIPE_COUNT; i++) {
        size_t bytes = (size_t)(RECIPES[i].end - RECIPES[i].begin);
        glimpse_status status = scan_material(RECIPES[i].name, RECIPES[i].begin, bytes);
        if (status != GLIMPSE_STATUS_OK) return fail(RECIPES[i].name, status);
    }
    return 0;
}
