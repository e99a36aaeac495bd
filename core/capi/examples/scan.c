/* Scans a material with each recipe, step by step. The same file is compiled for a host and for
   microcontrollers. */

#include "example.h"

/* Memory of a scan, reused by the next one. */
static GLIMPSE_MEMORY(memory, GLIMPSE_SCAN_BYTES(RECIPE_WORDS));

/* Prints all values of a fitted material on a line, from which a host renders it. */
static glimpse_status print_values(const char *name, const glimpse_scan *scan)
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
        if (status == GLIMPSE_STATUS_OK) status = read_sensor(&sample.directions, 1, &reading);
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

    /* An implausible material (status 84 to 95) also has a result. This example treats it as a failure. */
    status = glimpse_fit_finish(scan);
    if (status != GLIMPSE_STATUS_OK) return status;
    status = print_fitted(name, scan);
    if (status == GLIMPSE_STATUS_OK) status = print_values(name, scan);
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
