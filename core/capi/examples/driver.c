/* Scans a material with each recipe. The driver returns the next action of this loop. This example has no
   host. With a host, the same loop also exchanges bytes with it. */

#include "example.h"

static GLIMPSE_MEMORY(memory, GLIMPSE_DRIVER_BYTES(RECIPE_WORDS));

/* Reads the sample with this index. A scanner would first move its arms to sample.directions. */
static glimpse_status measure(glimpse_driver *driver, uint16_t index)
{
    const glimpse_scan *scan;
    glimpse_sample sample;
    glimpse_status status = glimpse_driver_scan(driver, &scan);
    if (status == GLIMPSE_STATUS_OK) status = glimpse_scan_next(scan, index, &sample);
    if (status != GLIMPSE_STATUS_OK) return status;
    glimpse_reading reading = read_sensor(&sample);
    return glimpse_driver_record(driver, index, &reading);
}

static glimpse_status scan_material(const char *name, const uint8_t *recipe, size_t recipe_bytes)
{
    glimpse_config config = glimpse_config_default(GLIMPSE_HOST_ABSENT);
    glimpse_driver *driver;
    glimpse_status status = glimpse_driver_begin(memory, sizeof memory, recipe, recipe_bytes,
                                                 &config, NULL, 0, &driver);
    uint64_t now_ms = 0; /* the time of a monotonic clock */
    while (status == GLIMPSE_STATUS_OK) {
        /* With a serial line: first pass received bytes to glimpse_driver_receive(), send as many bytes of
           glimpse_driver_outgoing() as possible, and call glimpse_driver_sent() with their number. */
        glimpse_action action;
        status = glimpse_driver_poll(driver, now_ms++, &action);
        if (status != GLIMPSE_STATUS_OK) break;
        switch (action.kind) {
        case GLIMPSE_ACTION_KIND_MEASURE:
            status = measure(driver, action.index);
            break;
        case GLIMPSE_ACTION_KIND_FINISHED: {
            const glimpse_scan *scan;
            status = glimpse_driver_scan(driver, &scan);
            return status == GLIMPSE_STATUS_OK ? print_values(name, scan) : status;
        }
        case GLIMPSE_ACTION_KIND_FAILED:
            return action.failure;
        case GLIMPSE_ACTION_KIND_SAVE:   /* save action.index and action.reading to flash */
        case GLIMPSE_ACTION_KIND_FORGET: /* delete all saved readings */
        case GLIMPSE_ACTION_KIND_STORE:  /* write action.bytes of a new recipe */
        case GLIMPSE_ACTION_KIND_INSTALL:
        case GLIMPSE_ACTION_KIND_WAIT: /* sleep for glimpse_driver_poll_delay() or until a byte arrives */
        case GLIMPSE_ACTION_KIND_CONTINUE:
        default:
            break;
        }
    }
    return status;
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
