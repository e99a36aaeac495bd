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
static uint8_t buffer[64];

#define AREA_BYTES GLIMPSE_STORE_BYTES(8)
static uint8_t areas[2 * AREA_BYTES];
static const glimpse_flash flash = {areas, read_flash, erase_flash, write_flash, 0, AREA_BYTES};
static const glimpse_flash incomplete[3] = {{.erase = erase_flash, .write = write_flash, .area_bytes = AREA_BYTES},
                                            {.read = read_flash, .write = write_flash, .area_bytes = AREA_BYTES},
                                            {.read = read_flash, .erase = erase_flash, .area_bytes = AREA_BYTES}};

/* A flash that fails after this number of calls. */
static unsigned calls_left, calls;

static int read_or_fail(void *context, uint32_t offset, uint8_t *bytes, size_t n)
{
    return calls_left ? calls_left--, read_flash(context, offset, bytes, n) : -1;
}

static int erase_or_fail(void *context, uint32_t from, uint32_t to)
{
    return calls_left ? calls_left--, erase_flash(context, from, to) : 1;
}

static int write_or_fail(void *context, uint32_t offset, const uint8_t *bytes, size_t n)
{
    return calls_left ? calls_left--, write_flash(context, offset, bytes, n) : 1;
}

static const glimpse_flash unreliable = {areas, read_or_fail, erase_or_fail, write_or_fail, 0, AREA_BYTES};
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
static uint32_t boots;
static uint16_t restored;
static glimpse_action action;
static float brdf[3];
static size_t count;
static uint32_t delay;
static const uint8_t *outgoing;

/* Expects all functions that only read a scan to return a status, or a result if it is GLIMPSE_STATUS_OK. */
static void read_scan(const glimpse_scan *scan, glimpse_status expected)
{
    int is_ok = expected == GLIMPSE_STATUS_OK;
    glimpse_status not_fitted = is_ok ? GLIMPSE_STATUS_NOT_FITTED : expected;
    EXPECT(expected, glimpse_scan_next(scan, 0, &sample));
    EXPECT(is_ok ? GLIMPSE_STATUS_NOT_READ : expected, glimpse_scan_reading(scan, 0, &read));
    EXPECT(not_fitted, glimpse_fitted_describe(scan, &fitted));
    EXPECT(not_fitted, glimpse_fitted_brdf(scan, &directions, &brdf));
    EXPECT(not_fitted, glimpse_fitted_values(scan, values, 8, &count));
    EXPECT(expected, glimpse_machine_nearest(&machine, scan, &arms, &next));
    EXPECT(expected, glimpse_store_count_boot(&flash, scan, &boots));
    EXPECT(expected, glimpse_store_save(&flash, scan, 0, NULL));
    EXPECT(expected, glimpse_store_clear(&flash, scan));
}

/* Expects all functions that change a scan to return a status. */
static void change_scan(glimpse_scan *scan, glimpse_status expected)
{
    EXPECT(expected, glimpse_scan_set_basis(scan, buffer, 1));
    EXPECT(expected, glimpse_scan_restart(scan));
    EXPECT(expected, glimpse_scan_record(scan, 0, &reading, NULL));
    EXPECT(expected, glimpse_scan_skip(scan, 0));
    EXPECT(expected, glimpse_scan_finish_early(scan));
    EXPECT(expected, glimpse_fit_begin(scan));
    EXPECT(expected, glimpse_fit_advance(scan, 1, NULL));
    EXPECT(expected, glimpse_fit_finish(scan));
    EXPECT(expected, glimpse_store_restore(&flash, scan, NULL));
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
    EXPECT(expected, glimpse_driver_fail(driver, GLIMPSE_STATUS_MACHINE, 0, 0));
    EXPECT(expected == GLIMPSE_STATUS_OK ? GLIMPSE_STATUS_NOT_SCANNING : expected,
           glimpse_driver_skip(driver, 0));
    EXPECT(expected == GLIMPSE_STATUS_OK ? GLIMPSE_STATUS_NOT_SCANNING : expected,
           glimpse_driver_finish_early(driver));
    EXPECT(expected, glimpse_driver_resume(driver));
    EXPECT(expected, glimpse_driver_restart(driver));
}

static void invalid_pointers(glimpse_scan *scan, glimpse_driver *driver, const uint8_t *recipe, size_t bytes)
{
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
    BAD(VALUES, float, glimpse_fitted_values(scan, p, 8, &count));
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

    BAD(FLASH, glimpse_flash, glimpse_store_count_boot(p, scan, &boots));
    BAD(FLASH, glimpse_flash, glimpse_store_restore(p, scan, NULL));
    BAD(FLASH, glimpse_flash, glimpse_store_save(p, scan, 0, &reading));
    BAD(FLASH, glimpse_flash, glimpse_store_clear(p, scan));
    for (size_t i = 0; i < 3; i++) EXPECT(GLIMPSE_STATUS_ARGUMENT_FLASH, glimpse_store_clear(&incomplete[i], scan));
    BAD(RESULT, uint32_t, glimpse_store_count_boot(&flash, scan, p));
    ODD(uint16_t, glimpse_store_restore(&flash, scan, p));
    EXPECT(GLIMPSE_STATUS_ARGUMENT_READING, glimpse_store_save(&flash, scan, 0, (glimpse_reading *)(uintptr_t)0x1001));

    BAD(MEMORY, void, glimpse_driver_begin(p, size, recipe, bytes, &config, NULL, &driver));
    BYTES(RECIPE, glimpse_driver_begin(other, size, p, n, &config, NULL, &driver));
    BAD(CONFIG, glimpse_config, glimpse_driver_begin(other, size, recipe, bytes, p, NULL, &driver));
    EXPECT(GLIMPSE_STATUS_ARGUMENT_FLASH,
           glimpse_driver_begin(other, size, recipe, bytes, &config, &incomplete[0], &driver));
    BAD(RESULT, glimpse_driver *, glimpse_driver_begin(other, size, recipe, bytes, &config, NULL, p));
    if (driver) failures++; /* an error leaves no handle */
    EXPECT(GLIMPSE_STATUS_OK,
           glimpse_driver_begin(other, size, recipe, bytes, &config, &flash, &driver));
    BAD(RESULT, glimpse_action, glimpse_driver_poll(driver, 0, p));
    BAD(RESULT, uint32_t, glimpse_driver_poll_delay(driver, 0, p));
    BYTES(BYTES, glimpse_driver_receive(driver, p, n));
    BAD(RESULT, const uint8_t *, glimpse_driver_outgoing(driver, p, &count));
    BAD(RESULT, size_t, glimpse_driver_outgoing(driver, &outgoing, p));
    BAD(READING, glimpse_reading, glimpse_driver_record(driver, 0, p));
    BAD(RESULT, const glimpse_scan *, glimpse_driver_scan(driver, p));
    static const int32_t OTHERS[] = {GLIMPSE_STATUS_NO_REPLY, 127, 160, 65536 + GLIMPSE_STATUS_MACHINE, -1, INT32_MIN};
    for (size_t i = 0; i < sizeof OTHERS / sizeof OTHERS[0]; i++)
        EXPECT(GLIMPSE_STATUS_ARGUMENT_FAILURE, glimpse_driver_fail(driver, OTHERS[i], 0, 0));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_fail(driver, GLIMPSE_STATUS_STORAGE, 0, 0));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_fail(driver, GLIMPSE_STATUS_LOST_STEPS, 2, (uint32_t)-5));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_end(driver));

    read_scan(NULL, GLIMPSE_STATUS_ARGUMENT_SCAN);
    change_scan(NULL, GLIMPSE_STATUS_ARGUMENT_SCAN);
    use_driver(NULL, GLIMPSE_STATUS_ARGUMENT_DRIVER);
    read_scan((void *)(scan_memory + 1), GLIMPSE_STATUS_ARGUMENT_SCAN);
    change_scan((void *)(scan_memory + 1), GLIMPSE_STATUS_ARGUMENT_SCAN);
    use_driver((void *)(driver_memory + 1), GLIMPSE_STATUS_ARGUMENT_DRIVER);
}

static void stale_handles(glimpse_scan *scan, glimpse_driver *driver, const uint8_t *recipe, size_t bytes)
{
    const glimpse_scan *of_driver;

    /* Nothing has begun, or the memory was moved. */
    for (int moved = 0; moved < 2; moved++) {
        void *memory = moved ? moved_memory : unused_memory;
        memcpy(moved_memory, scan_memory, sizeof scan_memory);
        read_scan(memory, GLIMPSE_STATUS_STALE);
        change_scan(memory, GLIMPSE_STATUS_STALE);
        EXPECT(GLIMPSE_STATUS_STALE, glimpse_scan_end(memory));
        memcpy(moved_memory, driver_memory, sizeof driver_memory);
        use_driver(memory, GLIMPSE_STATUS_STALE);
        EXPECT(GLIMPSE_STATUS_STALE, glimpse_driver_end(memory));
    }
    /* A driver's scan can be read, but not changed. A scan is not a driver. */
    EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_scan(driver, &of_driver));
    read_scan(of_driver, GLIMPSE_STATUS_OK);
    change_scan((glimpse_scan *)(uintptr_t)of_driver, GLIMPSE_STATUS_READ_ONLY);
    EXPECT(GLIMPSE_STATUS_STALE, glimpse_scan_end((glimpse_scan *)(uintptr_t)of_driver));
    use_driver((glimpse_driver *)scan, GLIMPSE_STATUS_STALE);
    EXPECT(GLIMPSE_STATUS_STALE, glimpse_driver_end((glimpse_driver *)scan));
    /* The other kind is begun in the same memory, and handles are ended. */
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_begin(driver_memory, sizeof driver_memory, recipe, bytes, &scan));
    use_driver(driver, GLIMPSE_STATUS_STALE);
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_end(scan));
    read_scan(scan, GLIMPSE_STATUS_STALE);
    change_scan(scan, GLIMPSE_STATUS_STALE);
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

/* Machines, calibrations and counts that are invalid. */
static void invalid_data(const glimpse_scan *scan)
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
}

/* Places that are unsuitable, callbacks that fail, and readings of another recipe. */
static void invalid_flash(glimpse_scan *scan, glimpse_driver *driver, const uint8_t *recipe, size_t bytes)
{
    static const uint32_t PLACES[][2] = {
        {0, AREA_BYTES - 32}, {0, AREA_BYTES + 1}, {1, AREA_BYTES}, {UINT32_MAX - 31, AREA_BYTES}};
    for (size_t i = 0; i < sizeof PLACES / sizeof PLACES[0]; i++) {
        glimpse_flash unsuitable = {areas, read_flash, erase_flash, write_flash, PLACES[i][0], PLACES[i][1]};
        EXPECT(GLIMPSE_STATUS_STORE_LAYOUT, glimpse_store_clear(&unsuitable, scan));
    }
    /* Each call of a callback fails once, from an unknown content to a saved reading. */
    memset(areas, 0xA5, sizeof areas);
    for (calls_left = 0; glimpse_store_save(&unreliable, scan, 5, &reading) == GLIMPSE_STATUS_STORAGE;)
        calls_left = ++calls;
    /* If its flash fails, a driver is not begun. A late failure ends the use of an earlier driver in its memory. */
    EXPECT(GLIMPSE_STATUS_OK,
           glimpse_driver_begin(driver_memory, sizeof driver_memory, recipe, bytes, &config, NULL, &driver));
    glimpse_driver *earlier = driver;
    for (calls = calls_left = 0; glimpse_driver_begin(driver_memory, sizeof driver_memory, recipe, bytes, &config,
                                                      &unreliable, &driver) == GLIMPSE_STATUS_STORAGE;) {
        if (driver) failures++;
        calls_left = ++calls;
    }
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_reading((glimpse_scan *)driver, 5, &read));
    if (memcmp(read.brdf, reading.brdf, sizeof read.brdf)) failures++;
    calls_left = calls - 1;
    EXPECT(GLIMPSE_STATUS_STORAGE, glimpse_driver_begin(driver_memory, sizeof driver_memory, recipe, bytes, &config,
                                                        &unreliable, &driver));
    EXPECT(GLIMPSE_STATUS_STALE, glimpse_driver_end(earlier));

    glimpse_reading negative = {.brdf = {0, -2, 0}};
    EXPECT(GLIMPSE_STATUS_READING_INDEX, glimpse_store_save(&flash, scan, 8, NULL));
    EXPECT(GLIMPSE_STATUS_READING_NEGATIVE, glimpse_store_save(&flash, scan, 7, &negative));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_store_count_boot(&flash, scan, &boots));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_begin(moved_memory, sizeof moved_memory, linear_begin,
                                                 (size_t)(linear_end - linear_begin), &scan));
    EXPECT(GLIMPSE_STATUS_OK, glimpse_store_restore(&flash, scan, &restored));
    if (restored != 0) failures++;
    EXPECT(GLIMPSE_STATUS_OK, glimpse_store_count_boot(&flash, scan, &boots));
    if (boots != 2) failures++;
}

/* Recipes that are cut or damaged, and too little memory. */
static void unsuitable_recipes(glimpse_scan *scan, glimpse_driver *driver, const uint8_t *recipe, size_t bytes)
{
    size_t scan_bytes = glimpse_scan_bytes(recipe, bytes), driver_bytes = glimpse_driver_bytes(recipe, bytes);
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
    EXPECT(GLIMPSE_STATUS_MEMORY,
           glimpse_driver_begin(driver_memory, driver_bytes - 1, recipe, bytes, &config, NULL, &driver));
    EXPECT(GLIMPSE_STATUS_RECIPE_MAGIC,
           glimpse_driver_begin(driver_memory, driver_bytes, NULL, 0, &config, NULL, &driver));
    if (driver) failures++;
    EXPECT(GLIMPSE_STATUS_OK, glimpse_driver_begin(driver_memory, driver_bytes, recipe, bytes, &config, NULL, &driver));
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
    invalid_data(scan);
    stale_handles(scan, driver, recipe, bytes);
    EXPECT(GLIMPSE_STATUS_OK, glimpse_scan_begin(scan_memory, sizeof scan_memory, recipe, bytes, &scan));
    invalid_flash(scan, driver, recipe, bytes);
    return failures != 0;
}
