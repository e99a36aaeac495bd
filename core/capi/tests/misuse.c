/* Calls every function with each invalid argument, and with stale handles. Each call returns the status that names the
   argument, and the sanitizers find no access through it. */

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "../examples/example.h"

static int failures;

/* Expects a status of a call. */
#define EXPECT(expected, call)                                                                  \
    do {                                                                                        \
        glimpse_status found = (call);                                                          \
        if (found != (expected)) {                                                              \
            printf("%s: %d (%s) instead of %s\n", #call, (int)found, glimpse_status_text(found), #expected); \
            failures++;                                                                         \
        }                                                                                       \
    } while (0)

/* Expects a call to refuse the pointer `p`, null and misaligned. */
#define BAD(argument, type, call)                                                               \
    do {                                                                                        \
        type *p = NULL;                                                                         \
        EXPECT(GLIMPSE_STATUS_ARGUMENT_##argument, call);                                       \
        p = (type *)(uintptr_t)0x1001;                                                          \
        EXPECT(GLIMPSE_STATUS_ARGUMENT_##argument, call);                                       \
    } while (0)

/* Expects a call to refuse a misaligned optional result `p`. */
#define ODD(type, call)                                                                         \
    do {                                                                                        \
        type *p = (type *)(uintptr_t)0x1001;                                                    \
        EXPECT(GLIMPSE_STATUS_ARGUMENT_RESULT, call);                                           \
    } while (0)

/* Expects a call to refuse the array of `n` bytes at `p`: null, and too long. */
#define BYTES(argument, call)                                                                   \
    do {                                                                                        \
        uint8_t *p = NULL;                                                                      \
        size_t n = 1;                                                                           \
        EXPECT(GLIMPSE_STATUS_ARGUMENT_##argument, call);                                       \
        p = buffer, n = SIZE_MAX;                                                               \
        EXPECT(GLIMPSE_STATUS_ARGUMENT_##argument, call);                                       \
    } while (0)

#define WORDS 1024
static GLIMPSE_MEMORY(scan_memory, GLIMPSE_SCAN_BYTES(WORDS));
static GLIMPSE_MEMORY(driver_memory, GLIMPSE_DRIVER_BYTES(WORDS));
static GLIMPSE_MEMORY(moved_memory, GLIMPSE_DRIVER_BYTES(WORDS));
static GLIMPSE_MEMORY(unused_memory, 64);
static uint8_t buffer[GLIMPSE_SAVED_BYTES(64)];
static float values[8];

static glimpse_machine machine;
static glimpse_config config;
static glimpse_directions directions = {{0.6f, 0, 0.8f}, {-0.6f, 0, 0.8f}};
static glimpse_calibration calibration = {.white = {9, 9, 9}, .reflectance = {1, 1, 1}, .saturation = 10};
static const glimpse_reading reading = {.brdf = {0.1f, 0.2f, 0.3f}};
static const float counts[3] = {1, 2, 3};
static glimpse_repeated repeated;
static glimpse_arms arms;
static glimpse_move next;
static glimpse_sample sample;
static glimpse_reading read;
static glimpse_fitted fitted;
static glimpse_recipe described;
static glimpse_slot_write slot_write;
static glimpse_action action;
static float brdf[3];
static size_t count;
static uint32_t delay;
static const uint8_t *outgoing;

/* Expects all functions that only read a scan to return a status, or a result if it is GLIMPSE_STATUS_OK. */
static void read_scan(const glimpse_scan *scan, const glimpse_saved *saved, glimpse_status expected)
{
    int is_ok = expected == GLIMPSE_STATUS_OK;
    glimpse_status not_fitted = is_ok ? GLIMPSE_STATUS_NOT_FITTED : expected;
    EXPECT(expected, glimpse_scan_next(scan, 0, &sample));
    EXPECT(is_ok ? GLIMPSE_STATUS_NOT_READ : expected, glimpse_scan_reading(scan, 0, &read));
    EXPECT(not_fitted, glimpse_fitted_describe(scan, &fitted));
    EXPECT(not_fitted, glimpse_fitted_brdf(scan, &directions, &brdf));
    EXPECT(not_fitted, glimpse_fitted_values(scan, values, 8, &count));
    EXPECT(expected, glimpse_machine_nearest(&machine, scan, &arms, &next));
    EXPECT(expected, glimpse_saved_write(saved, scan, buffer, sizeof buffer, &slot_write));
}

/* Expects all functions that change a scan to return a status. */
static void change_scan(glimpse_scan *scan, const glimpse_saved *saved, glimpse_status expected)
{
    EXPECT(expected, glimpse_scan_set_basis(scan, buffer, 1));
    EXPECT(expected, glimpse_scan_restart(scan));
    EXPECT(expected, glimpse_scan_record(scan, 0, &reading, NULL));
    EXPECT(expected, glimpse_scan_skip(scan, 0));
    EXPECT(expected, glimpse_scan_finish_early(scan));
    EXPECT(expected, glimpse_fit_begin(scan));
    EXPECT(expected, glimpse_fit_advance(scan, 1, NULL));
    EXPECT(expected, glimpse_fit_finish(scan));
    EXPECT(expected, glimpse_saved_restore(saved, scan, NULL));
}

/* Expects all functions of a driver to return a status. */
static void use_driver(glimpse_driver *driver, glimpse_status expected)
{
    const glimpse_scan *scan;
    EXPECT(expected, glimpse_driver_poll(driver, 0, &action));
    EXPECT(expected, glimpse_driver_poll_delay(driver, 0, &delay));
    EXPECT(expected, glimpse_driver_receive(driver, buffer, 1));
    EXPECT(expected, glimpse_driver_outgoing(driver, &outgoing, &count));
    EXPECT(expected, glimpse_driver_sent(driver, 1));
    EXPECT(expected, glimpse_driver_record(driver, 0, &reading));
    EXPECT(expected, glimpse_driver_scan(driver, &scan));
    EXPECT(expected, glimpse_driver_fail(driver, GLIMPSE_STATUS_MACHINE));
    EXPECT(expected, glimpse_driver_resume(driver));
    EXPECT(expected, glimpse_driver_reject(driver, buffer, 1));
    EXPECT(expected == GLIMPSE_STATUS_OK ? GLIMPSE_STATUS_NOT_SCANNING : expected,
           glimpse_driver_skip(driver, 0));
    EXPECT(expected == GLIMPSE_STATUS_OK ? GLIMPSE_STATUS_NOT_SCANNING : expected,
           glimpse_driver_finish_early(driver));
    EXPECT(expected, glimpse_driver_restart(driver));
}

static void invalid_pointers(glimpse_scan *scan, glimpse_driver *driver, const uint8_t *recipe, size_t bytes)
{
    glimpse_saved saved = {{buffer, buffer}, sizeof buffer};
    glimpse_saved no_slot = {{buffer, NULL}, sizeof buffer};
    glimpse_saved too_long = {{buffer, buffer}, SIZE_MAX};
    void *other = moved_memory;
    size_t size = sizeof moved_memory;

    BYTES(RECIPE, glimpse_recipe_describe(p, n, &described));
    BAD(RESULT, glimpse_recipe, glimpse_recipe_describe(recipe, bytes, p));
    BAD(MEMORY, void, glimpse_scan_begin(p, size, recipe, bytes, &scan));
    BYTES(RECIPE, glimpse_scan_begin(other, size, p, n, &scan));
    BAD(RESULT, glimpse_scan *, glimpse_scan_begin(other, size, recipe, bytes, p));
    BAD(SCAN, glimpse_scan, glimpse_scan_end(p));
    if (glimpse_scan_begin(scan_memory, sizeof scan_memory, recipe, bytes, &scan)) failures++;

    BYTES(BASIS, glimpse_scan_set_basis(scan, p, n));
    BAD(RESULT, glimpse_sample, glimpse_scan_next(scan, 0, p));
    BAD(READING, glimpse_reading, glimpse_scan_record(scan, 0, p, NULL));
    BAD(RESULT, glimpse_reading, glimpse_scan_reading(scan, 0, p));
    ODD(glimpse_progress, glimpse_fit_advance(scan, 1, p));
    BAD(RESULT, glimpse_fitted, glimpse_fitted_describe(scan, p));
    BAD(DIRECTIONS, glimpse_directions, glimpse_fitted_brdf(scan, p, &brdf));
    BAD(RESULT, float, glimpse_fitted_brdf(scan, &directions, (float(*)[3])p));
    BAD(BUFFER, float, glimpse_fitted_values(scan, p, 8, &count));
    BAD(RESULT, size_t, glimpse_fitted_values(scan, values, 8, p));

    BAD(MACHINE, glimpse_machine, glimpse_machine_check(p, &directions));
    BAD(DIRECTIONS, glimpse_directions, glimpse_machine_check(&machine, p));
    BAD(MACHINE, glimpse_machine, glimpse_machine_nearest(p, scan, &arms, &next));
    BAD(ARMS, glimpse_arms, glimpse_machine_nearest(&machine, scan, p, &next));
    BAD(RESULT, glimpse_move, glimpse_machine_nearest(&machine, scan, &arms, p));
    calibration.footprint = GLIMPSE_FOOTPRINT_LIGHT_LARGER;
    calibration.reference = directions;
    BAD(CALIBRATION, glimpse_calibration, glimpse_calibrate(p, counts, &directions, &read));
    BAD(COUNTS, float, glimpse_calibrate(&calibration, p, &directions, &read));
    BAD(DIRECTIONS, glimpse_directions, glimpse_calibrate(&calibration, counts, p, &read));
    BAD(RESULT, glimpse_reading, glimpse_calibrate(&calibration, counts, &directions, p));
    calibration.footprint = 3;
    EXPECT(GLIMPSE_STATUS_ARGUMENT_CALIBRATION, glimpse_calibrate(&calibration, counts, &directions, &read));
    BAD(REPEATED, glimpse_repeated, glimpse_repeated_add(p, counts, 0));
    BAD(READING, float, glimpse_repeated_add(&repeated, p, 0));

    BAD(SAVED, glimpse_saved, glimpse_saved_restore(p, scan, NULL));
    EXPECT(GLIMPSE_STATUS_ARGUMENT_SAVED, glimpse_saved_restore(&no_slot, scan, NULL));
    EXPECT(GLIMPSE_STATUS_ARGUMENT_SAVED, glimpse_saved_restore(&too_long, scan, NULL));
    ODD(size_t, glimpse_saved_restore(&saved, scan, p));
    BAD(SAVED, glimpse_saved, glimpse_saved_write(p, scan, buffer, 9, &slot_write));
    BYTES(BUFFER, glimpse_saved_write(&saved, scan, p, n, &slot_write));
    BAD(RESULT, glimpse_slot_write, glimpse_saved_write(&saved, scan, buffer, 9, p));
    BAD(SAVED, glimpse_saved, glimpse_saved_clear(p, buffer, 99, &slot_write));
    BYTES(BUFFER, glimpse_saved_clear(&saved, p, n, &slot_write));
    BAD(RESULT, glimpse_slot_write, glimpse_saved_clear(&saved, buffer, 99, p));

    BAD(MEMORY, void, glimpse_driver_begin(p, size, recipe, bytes, &config, NULL, &driver));
    BYTES(RECIPE, glimpse_driver_begin(other, size, p, n, &config, NULL, &driver));
    BAD(CONFIG, glimpse_config, glimpse_driver_begin(other, size, recipe, bytes, p, NULL, &driver));
    EXPECT(GLIMPSE_STATUS_ARGUMENT_SAVED,
           glimpse_driver_begin(other, size, recipe, bytes, &config, &no_slot, &driver));
    BAD(RESULT, glimpse_driver *, glimpse_driver_begin(other, size, recipe, bytes, &config, NULL, p));
    if (driver) failures++; /* an error leaves no handle */
    EXPECT(GLIMPSE_STATUS_OK,
           glimpse_driver_begin(other, size, recipe, bytes, &config, &saved, &driver));
    BAD(RESULT, glimpse_action, glimpse_driver_poll(driver, 0, p));
    BAD(RESULT, uint32_t, glimpse_driver_poll_delay(driver, 0, p));
    BYTES(BYTES, glimpse_driver_receive(driver, p, n));
    BAD(RESULT, const uint8_t *, glimpse_driver_outgoing(driver, p, &count));
    BAD(RESULT, size_t, glimpse_driver_outgoing(driver, &outgoing, p));
    BAD(READING, glimpse_reading, glimpse_driver_record(driver, 0, p));
    BYTES(RECIPE, glimpse_driver_reject(driver, p, n));
    BAD(RESULT, const glimpse_scan *, glimpse_driver_scan(driver, p));
    EXPECT(GLIMPSE_STATUS_ARGUMENT_RECIPE, glimpse_driver_reject(driver, recipe, bytes)); /* it is usable */
    EXPECT(GLIMPSE_STATUS_ARGUMENT_FAILURE, glimpse_driver_fail(driver, GLIMPSE_STATUS_NO_REPLY));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_end(driver));

    read_scan(NULL, &saved, GLIMPSE_STATUS_ARGUMENT_SCAN);
    change_scan(NULL, &saved, GLIMPSE_STATUS_ARGUMENT_SCAN);
    use_driver(NULL, GLIMPSE_STATUS_ARGUMENT_DRIVER);
    read_scan((void *)(scan_memory + 1), &saved, GLIMPSE_STATUS_ARGUMENT_SCAN);
    change_scan((void *)(scan_memory + 1), &saved, GLIMPSE_STATUS_ARGUMENT_SCAN);
    use_driver((void *)(driver_memory + 1), GLIMPSE_STATUS_ARGUMENT_DRIVER);
}

static void stale_handles(glimpse_scan *scan, glimpse_driver *driver, const uint8_t *recipe, size_t bytes)
{
    glimpse_saved saved = {{buffer, buffer}, sizeof buffer};
    const glimpse_scan *of_driver;

    /* Nothing has begun, or the memory was moved. */
    for (int moved = 0; moved < 2; moved++) {
        void *memory = moved ? moved_memory : unused_memory;
        memcpy(moved_memory, scan_memory, sizeof scan_memory);
        read_scan(memory, &saved, GLIMPSE_STATUS_STALE);
        change_scan(memory, &saved, GLIMPSE_STATUS_STALE);
        EXPECT(GLIMPSE_STATUS_STALE, glimpse_scan_end(memory));
        memcpy(moved_memory, driver_memory, sizeof driver_memory);
        use_driver(memory, GLIMPSE_STATUS_STALE);
        EXPECT(GLIMPSE_STATUS_STALE, glimpse_driver_end(memory));
    }
    /* A driver's scan can be read, but not changed. A scan is not a driver. */
    EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_scan(driver, &of_driver));
    read_scan(of_driver, &saved, GLIMPSE_STATUS_OK);
    change_scan((glimpse_scan *)(uintptr_t)of_driver, &saved, GLIMPSE_STATUS_READ_ONLY);
    EXPECT(GLIMPSE_STATUS_STALE, glimpse_scan_end((glimpse_scan *)(uintptr_t)of_driver));
    use_driver((glimpse_driver *)scan, GLIMPSE_STATUS_STALE);
    EXPECT(GLIMPSE_STATUS_STALE, glimpse_driver_end((glimpse_driver *)scan));
    /* A driver without a recipe has no scan. */
    EXPECT(GLIMPSE_STATUS_OK,
           glimpse_driver_begin(driver_memory, sizeof driver_memory, NULL, 0, &config, NULL, &driver));
    EXPECT(GLIMPSE_STATUS_NOT_SCANNING, glimpse_driver_scan(driver, &of_driver));
    if (of_driver) failures++;
    read_scan((glimpse_scan *)driver, &saved, GLIMPSE_STATUS_NOT_SCANNING);
    /* The other kind is begun in the same memory, and handles are ended. */
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_begin(driver_memory, sizeof driver_memory, recipe, bytes, &scan));
    use_driver(driver, GLIMPSE_STATUS_STALE);
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_end(scan));
    read_scan(scan, &saved, GLIMPSE_STATUS_STALE);
    change_scan(scan, &saved, GLIMPSE_STATUS_STALE);
    EXPECT(GLIMPSE_STATUS_STALE, glimpse_scan_end(scan));
    EXPECT(GLIMPSE_STATUS_OK,
           glimpse_driver_begin(driver_memory, sizeof driver_memory, recipe, bytes, &config, NULL, &driver));
    use_driver(driver, GLIMPSE_STATUS_OK);
    EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_end(driver));
    use_driver(driver, GLIMPSE_STATUS_STALE);
}

/* Begins a driver with one changed option. */
#define OPTION(expected, field, value)                                                          \
    do {                                                                                        \
        config = glimpse_config_default(GLIMPSE_HOST_ABSENT);                                   \
        config.has_machine = 1;                                                                 \
        config.field = value;                                                                   \
        EXPECT(expected, glimpse_driver_begin(driver_memory, sizeof driver_memory, recipe, bytes, \
                                              &config, NULL, &driver));                         \
    } while (0)

static void invalid_options(glimpse_driver *driver, const uint8_t *recipe, size_t bytes)
{
    OPTION(GLIMPSE_STATUS_ARGUMENT_HOST, host, 3);
    OPTION(GLIMPSE_STATUS_ARGUMENT_HOST, host, -1);
    OPTION(GLIMPSE_STATUS_ARGUMENT_TARGET_LOSS, target_loss, -0.1f);
    OPTION(GLIMPSE_STATUS_ARGUMENT_TARGET_LOSS, target_loss, NAN);
    OPTION(GLIMPSE_STATUS_ARGUMENT_MACHINE, machine.limits.max_theta_o, 0);
    OPTION(GLIMPSE_STATUS_ARGUMENT_MACHINE, machine.limits.max_theta_i, NAN);
    OPTION(GLIMPSE_STATUS_ARGUMENT_MACHINE, machine.limits.min_separation, 4);
    OPTION(GLIMPSE_STATUS_OK, machine.speeds.phi_i, NAN);
    config.machine.limits.max_theta_i = NAN;
    config.has_machine = 0; /* the machine has no effect */
    EXPECT(GLIMPSE_STATUS_OK,
           glimpse_driver_begin(driver_memory, sizeof driver_memory, recipe, bytes, &config, NULL, &driver));
    config = glimpse_config_default(GLIMPSE_HOST_ABSENT);
}

/* Expects a status of a calibration with one changed field. */
#define CALIBRATION_WITH(expected, field, value)                                                \
    do {                                                                                        \
        glimpse_calibration changed = CALIBRATION;                                              \
        changed.field = value;                                                                  \
        EXPECT(expected, glimpse_calibrate(&changed, counts, &directions, &read));             \
    } while (0)

/* Machines, calibrations, counts and saved readings that are invalid. */
static void invalid_data(glimpse_scan *scan, const uint8_t *recipe, size_t bytes)
{
    static const glimpse_directions HORIZON = {{1, 0, 0}, {0, 0, 1}};
    static const float BROKEN[3] = {1, NAN, 3};
    machine.limits.max_theta_i = 0.01f;
    EXPECT(GLIMPSE_STATUS_MAX_THETA_I, glimpse_machine_check(&machine, &directions));
    EXPECT(GLIMPSE_STATUS_OUT_OF_REACH, glimpse_machine_nearest(&machine, scan, &arms, &next));
    machine.limits.max_theta_i = NAN;
    EXPECT(GLIMPSE_STATUS_ARGUMENT_MACHINE, glimpse_machine_check(&machine, &directions));
    EXPECT(GLIMPSE_STATUS_ARGUMENT_MACHINE, glimpse_machine_nearest(&machine, scan, &arms, &next));
    machine = glimpse_machine_default();
    machine.speeds.phi_i = machine.speeds.phi_o = 0;
    machine.fixed.phi_o = 1; /* the mirror direction has another azimuth */
    EXPECT(GLIMPSE_STATUS_MISSING_AXIS, glimpse_machine_check(&machine, &directions));
    machine.fixed.phi_o = 3.1415927f;
    EXPECT(GLIMPSE_STATUS_OK, glimpse_machine_check(&machine, &directions));
    EXPECT(GLIMPSE_STATUS_DIRECTIONS, glimpse_machine_check(&machine, &HORIZON));
    machine = glimpse_machine_default();

    CALIBRATION_WITH(GLIMPSE_STATUS_CHANNEL_NON_FINITE, dark[1], NAN);
    CALIBRATION_WITH(GLIMPSE_STATUS_WHITE_NOT_BRIGHTER, white[2], 100);
    CALIBRATION_WITH(GLIMPSE_STATUS_WHITE_REFLECTANCE, reflectance[0], 99);
    CALIBRATION_WITH(GLIMPSE_STATUS_WHITE_SATURATED, saturation, 3000);
    CALIBRATION_WITH(GLIMPSE_STATUS_WHITE_SATURATED, saturation, 0);
    CALIBRATION_WITH(GLIMPSE_STATUS_OK, saturation, INFINITY);
    CALIBRATION_WITH(GLIMPSE_STATUS_ARGUMENT_CALIBRATION, footprint, -1);
    CALIBRATION_WITH(GLIMPSE_STATUS_DIRECTIONS, reference, HORIZON);
    EXPECT(GLIMPSE_STATUS_DIRECTIONS, glimpse_calibrate(&CALIBRATION, counts, &HORIZON, &read));
    EXPECT(GLIMPSE_STATUS_CHANNEL_NON_FINITE, glimpse_calibrate(&CALIBRATION, BROKEN, &directions, &read));
    calibration = CALIBRATION;
    calibration.footprint = GLIMPSE_FOOTPRINT_ANY;
    calibration.saturation = 5000;
    static const float SATURATED[3] = {3000, 5000, 3000};
    EXPECT(GLIMPSE_STATUS_OK, glimpse_calibrate(&calibration, SATURATED, NULL, &read));
    if (!read.saturated || read.brdf[0] != 0.99f * 0.318309886f) failures++;

    repeated = (glimpse_repeated){0};
    EXPECT(GLIMPSE_STATUS_OK, glimpse_repeated_add(&repeated, counts, 0));
    if (!isnan(repeated.variance[0])) failures++;
    EXPECT(GLIMPSE_STATUS_CHANNEL_NON_FINITE, glimpse_repeated_add(&repeated, BROKEN, 1));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_repeated_add(&repeated, SATURATED, 1));
    if (repeated.count != 2 || !repeated.saturated || repeated.mean[2] != 1501.5f) failures++;
    if (repeated.variance[2] != 2997.0f * 2997.0f / 2) failures++;
    repeated.squares[1] = NAN; /* nothing that C writes to it is harmful */
    EXPECT(GLIMPSE_STATUS_CHANNEL_NON_FINITE, glimpse_repeated_add(&repeated, counts, 0));

    static uint8_t slots[2][GLIMPSE_SAVED_BYTES(8)];
    glimpse_saved saved = {{slots[0], slots[1]}, sizeof slots[0]};
    EXPECT(GLIMPSE_STATUS_SAVED_DAMAGED, glimpse_saved_restore(&saved, scan, &count));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_record(scan, 5, &reading, NULL));
    EXPECT(GLIMPSE_STATUS_BUFFER_TOO_SMALL, glimpse_saved_write(&saved, scan, buffer, 28, &slot_write));
    EXPECT(GLIMPSE_STATUS_BUFFER_TOO_SMALL, glimpse_saved_clear(&saved, buffer, 13, &slot_write));
    for (size_t written = 0; written < 2; written++) {
        EXPECT(GLIMPSE_STATUS_OK, glimpse_saved_write(&saved, scan, buffer, sizeof buffer, &slot_write));
        if (slot_write.slot != 0) failures++; /* the write did not happen, or was interrupted */
        memcpy(slots[0], buffer, slot_write.count - 1 + written);
    }
    EXPECT(GLIMPSE_STATUS_OK, glimpse_saved_write(&saved, scan, buffer, sizeof buffer, &slot_write));
    if (slot_write.slot != 1 || slot_write.count != GLIMPSE_SAVED_BYTES(1)) failures++;
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_restart(scan));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_saved_restore(&saved, scan, &count));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_reading(scan, 5, &read));
    if (count != 1 || memcmp(read.brdf, reading.brdf, sizeof read.brdf)) failures++;
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_begin(moved_memory, sizeof moved_memory, linear_begin,
                                                 (size_t)(linear_end - linear_begin), &scan));
    EXPECT(GLIMPSE_STATUS_SAVED_RECIPE, glimpse_saved_restore(&saved, scan, NULL));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_saved_clear(&saved, buffer, sizeof buffer, &slot_write));
    memcpy(slots[slot_write.slot], buffer, slot_write.count);
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_begin(moved_memory, sizeof moved_memory, recipe, bytes, &scan));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_saved_restore(&saved, scan, &count));
    if (count != 0) failures++;
}

/* Recipes that are cut or damaged, and too little memory. */
static void unsuitable_recipes(glimpse_scan *scan, glimpse_driver *driver, const uint8_t *recipe, size_t bytes)
{
    size_t scan_bytes = glimpse_scan_bytes(recipe, bytes), driver_bytes = glimpse_driver_bytes(recipe, bytes);
    size_t neural_bytes = (size_t)(neural_end - neural_begin);
    if (glimpse_scan_bytes(recipe, bytes - 1) || glimpse_driver_bytes(recipe, bytes - 1)) failures++;
    if (glimpse_scan_bytes(NULL, 9) || glimpse_driver_bytes(NULL, 0)) failures++;
    EXPECT(GLIMPSE_STATUS_RECIPE_MAGIC, glimpse_scan_begin(scan_memory, scan_bytes, NULL, 0, &scan));
    EXPECT(GLIMPSE_STATUS_RECIPE_LENGTH, glimpse_scan_begin(scan_memory, scan_bytes, recipe, bytes - 1, &scan));
    EXPECT(GLIMPSE_STATUS_MEMORY, glimpse_scan_begin(scan_memory, scan_bytes - 1, recipe, bytes, &scan));
    EXPECT(GLIMPSE_STATUS_MEMORY, glimpse_scan_begin(scan_memory, 0, recipe, bytes, &scan));
    if (scan) failures++; /* an error leaves no handle */
    memcpy(moved_memory + 1, recipe, bytes); /* a recipe may have any alignment */
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_begin(scan_memory, scan_bytes, moved_memory + 1, bytes, &scan));
    moved_memory[bytes] ^= 1;
    EXPECT(GLIMPSE_STATUS_RECIPE_CHECKSUM, glimpse_recipe_describe(moved_memory + 1, bytes, &described));

    EXPECT(GLIMPSE_STATUS_MEMORY, glimpse_driver_begin(driver_memory, 99, recipe, bytes, &config, NULL, &driver));
    for (int rejects = 0; rejects < 2; rejects++) {
        /* The recipe at the begin, or the rejected one, needs more memory than the driver has. */
        EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_begin(driver_memory, driver_bytes - (rejects ? 0 : 4), recipe, bytes,
                                                       &config, NULL, &driver));
        if (rejects) EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_reject(driver, neural_begin, neural_bytes));
        EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_poll(driver, 0, &action));
        if (action.kind != GLIMPSE_ACTION_KIND_FAILED || action.failure != GLIMPSE_STATUS_MEMORY) failures++;
    }
}

int main(void)
{
    glimpse_scan *scan = NULL;
    glimpse_driver *driver = NULL;
    const uint8_t *recipe = phong_begin;
    size_t bytes = (size_t)(phong_end - phong_begin);
    machine = glimpse_machine_default();
    invalid_options(driver, recipe, bytes);
    unsuitable_recipes(scan, driver, recipe, bytes);
    invalid_pointers(scan, driver, recipe, bytes);
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_begin(scan_memory, sizeof scan_memory, recipe, bytes, &scan));
    EXPECT(GLIMPSE_STATUS_OK,
           glimpse_driver_begin(driver_memory, sizeof driver_memory, recipe, bytes, &config, NULL, &driver));
    invalid_data(scan, recipe, bytes);
    stale_handles(scan, driver, recipe, bytes);
    return failures != 0;
}
