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

    /* Samples may be read in any order. This example reads the one that the arms reach first. */
    glimpse_machine machine = glimpse_machine_default();
    machine.limits.min_separation = 0.01f;
    machine.through_normal = 1;
    glimpse_arms arms = {0, 0, 0, 0};
    glimpse_move move;
    float seconds = 0;
    while ((status = glimpse_machine_nearest(&machine, scan, &arms, &move)) == GLIMPSE_STATUS_OK) {
        glimpse_sample sample;
        glimpse_reading reading;
        status = glimpse_scan_next(scan, move.index, &sample);
        if (status == GLIMPSE_STATUS_OK) status = read_sensor(&sample, &reading);
        if (status == GLIMPSE_STATUS_OK) status = glimpse_scan_record(scan, move.index, &reading, NULL);
        if (status != GLIMPSE_STATUS_OK) return status;
        arms = move.arms;
        seconds += move.seconds;
    }
    if (status != GLIMPSE_STATUS_NONE_PENDING) return status; /* samples are out of reach */
    print_number(name, ".seconds=", seconds);

    status = glimpse_fit_begin(scan);
    glimpse_progress progress = {0, 1};
    while (status == GLIMPSE_STATUS_OK && progress.done < progress.total)
        status = glimpse_fit_advance(scan, 8, &progress); /* service motors and watchdog here */
    if (status != GLIMPSE_STATUS_OK) return status;

    /* An implausible material (status 84 to 91) also has a result. This example treats it as a failure. */
    status = glimpse_fit_finish(scan);
    if (status != GLIMPSE_STATUS_OK) return status;
    glimpse_fitted fitted;
    status = glimpse_fitted_describe(scan, &fitted);
    if (status != GLIMPSE_STATUS_OK) return status;
    print_number(name, ".mean=", fitted.residual.mean);
    print_number(name, ".worst=", fitted.residual.worst);
    print_number(name, ".predicted=", fitted.predicted_loss);

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
    status = print_values(name, scan);
    return status == GLIMPSE_STATUS_OK ? glimpse_scan_end(scan) : status;
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
