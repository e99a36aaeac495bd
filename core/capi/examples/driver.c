/* Scans a material with each recipe. The driver returns the next action of this loop. This example has no
   host. With a host, the same loop also exchanges bytes with it. */

#include "example.h"

static GLIMPSE_MEMORY(memory, GLIMPSE_DRIVER_BYTES(RECIPE_WORDS));

/* Memory that survives a reset. In flash, an area is whole sectors. */
#define AREA_BYTES GLIMPSE_STORE_BYTES(8)
static uint8_t areas[2 * AREA_BYTES];
static const glimpse_flash FLASH = {areas, read_flash, erase_flash, write_flash, 0, AREA_BYTES};

/* Makes the reading that the driver requests. */
static glimpse_status measure(glimpse_driver *driver, const glimpse_action *action)
{
    glimpse_reading reading;
    int is_lit = action->purpose != GLIMPSE_PURPOSE_DARK; /* the lamp's switch */
    glimpse_status status = read_sensor(&action->directions, is_lit, &reading);
    if (status != GLIMPSE_STATUS_OK) return status;
    status = glimpse_driver_record(driver, action->index, &reading);
    /* The driver requests an invalid reading (64 or 65) again. */
    return status == GLIMPSE_STATUS_READING_NON_FINITE || status == GLIMPSE_STATUS_READING_NEGATIVE
               ? GLIMPSE_STATUS_OK
               : status;
}

static glimpse_status begin(glimpse_driver **driver, const uint8_t *recipe, size_t recipe_bytes)
{
    glimpse_config config = glimpse_config_default(GLIMPSE_HOST_ABSENT);
    config.has_machine = 1;
    config.machine.limits.min_separation = 0.01f; /* before any move, the driver checks the whole recipe */
    return glimpse_driver_begin(memory, sizeof memory, recipe, recipe_bytes, &config, &FLASH, driver);
}

static glimpse_status scan_material(const char *name, const uint8_t *recipe, size_t recipe_bytes)
{
    glimpse_driver *driver;
    glimpse_status status = begin(&driver, recipe, recipe_bytes);
    uint32_t now_ms = 0; /* the time of a monotonic clock, which may wrap */
    int moves = 0, is_finished = 0, has_failed = 0;
    while (status == GLIMPSE_STATUS_OK) {
        /* With a serial line: first pass received bytes to glimpse_driver_receive(), send as many bytes of
           glimpse_driver_outgoing() as possible, and call glimpse_driver_sent() with their number. */
        glimpse_action action;
        const glimpse_scan *scan;
        status = glimpse_driver_poll(driver, now_ms++, &action);
        if (status == GLIMPSE_STATUS_OK) status = glimpse_driver_scan(driver, &scan);
        if (status != GLIMPSE_STATUS_OK) break;
        switch (action.kind) {
        case GLIMPSE_ACTION_KIND_MEASURE:
            if (moves == 2 && !has_failed) {
                status = glimpse_driver_fail(driver, GLIMPSE_STATUS_MACHINE, 0, 0); /* simulates a stalled motor */
                break;
            }
            moves++;
            status = measure(driver, &action);
            break;
        case GLIMPSE_ACTION_KIND_FAILED:
            /* Nothing moves until somebody has cleared the fault. The readings are kept. */
            if (action.failure != GLIMPSE_STATUS_MACHINE) return action.failure;
            has_failed = 1;
            status = glimpse_driver_resume(driver);
            break;
        case GLIMPSE_ACTION_KIND_SAVE:
            status = glimpse_store_save(&FLASH, scan, action.index, action.has_reading ? &action.reading : NULL);
            if (moves == 5) status = begin(&driver, recipe, recipe_bytes); /* simulates a reset */
            break;
        case GLIMPSE_ACTION_KIND_FINISHED:
            if (action.residual.implausible) return (glimpse_status)action.residual.implausible;
            is_finished = 1;
            print_number(name, ".moves=", (float)moves);
            status = print_fitted(name, scan);
            break;
        case GLIMPSE_ACTION_KIND_FORGET:
            status = glimpse_store_clear(&FLASH, scan);
            break;
        case GLIMPSE_ACTION_KIND_WAIT: /* sleep for glimpse_driver_poll_delay() or until a byte arrives */
            if (is_finished) return glimpse_driver_end(driver); /* or glimpse_driver_restart() */
            break;
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
