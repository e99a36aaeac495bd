/* Scans a material by each recipe with the driver, which says what to do next. Here nobody is at the
   other end of a line; with a host, bytes come and go in the same loop. */

#include "example.h"

static GLIMPSE_MEMORY(memory, GLIMPSE_DRIVER_BYTES);

/* Where the arms of a scanner would go: the sample with this index, with its angles. */
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
    while (status == GLIMPSE_STATUS_OK) {
        /* With a line, first: glimpse_driver_receive() what came, and send what
           glimpse_driver_outgoing() has as far as there is room, then glimpse_driver_sent(). */
        glimpse_action action;
        uint32_t elapsed = 1; /* milliseconds since the last turn */
        status = glimpse_driver_poll(driver, elapsed, &action);
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
        case GLIMPSE_ACTION_KIND_SAVE:   /* keep action.index and action.reading in flash */
        case GLIMPSE_ACTION_KIND_FORGET: /* forget those kept */
        case GLIMPSE_ACTION_KIND_STORE:  /* write action.bytes of a new recipe to flash */
        case GLIMPSE_ACTION_KIND_INSTALL:
        case GLIMPSE_ACTION_KIND_WAIT: /* sleep until a byte or the next millisecond comes */
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
