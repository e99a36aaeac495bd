/*
 * Glimpse for firmware in C: measures a material's reflectance (BRDF) at the few directions that a
 * recipe names, and fits a model to them.
 *
 *     GLIMPSE_MEMORY(memory, GLIMPSE_SCAN_BYTES);
 *
 *     glimpse_scan_begin(memory, sizeof memory, recipe, recipe_bytes, &scan);
 *     while (glimpse_scan_next(scan, 0, &sample) == GLIMPSE_STATUS_OK) {
 *         ... move the arms to sample.directions and read the sensor ...
 *         glimpse_scan_record(scan, sample.index, &reading, NULL);
 *     }
 *     glimpse_fit_begin(scan);
 *     do glimpse_fit_advance(scan, 8, &progress); while (progress.done < progress.total);
 *     glimpse_fit_finish(scan, &residual);
 *     glimpse_fitted_brdf(scan, &directions, &brdf);
 *
 * Everywhere:
 * - Directions are unit vectors away from the surface, z its normal; angles are in radians. A BRDF is
 *   in linear RGB, sr^-1, and not times the cosine.
 * - Memory is the caller's; nothing is allocated, nothing has to be freed, and there is no global
 *   state. Two scans in two memories know nothing of each other.
 * - One scan or driver is used by one thread at a time, and by no interrupt that may come during a
 *   call.
 * - Null and misaligned pointers are found and told by status. That a pointer leads to what its type
 *   says, and to as many as are said, is the caller's part; so is that handles came from the function
 *   that makes them, with GLIMPSE_STATUS_OK. Results must not be written into the memory of a scan or
 *   driver.
 * - No call waits, and none takes longer than its units of work.
 *
 * This file is generated from core/capi/src by cbindgen. SPDX-License-Identifier: MIT OR Apache-2.0
 */

#ifndef GLIMPSE_H
#define GLIMPSE_H

#include <stddef.h>
#include <stdint.h>

/** The version of this file; glimpse_version() is the library's. */
#define GLIMPSE_VERSION "0.2.0"

/** The largest n, how many samples a recipe may have. Built into the library by the environment
    variable of the same name; define it here alike, before this file. */
#ifndef GLIMPSE_SAMPLES
#define GLIMPSE_SAMPLES 32
#endif

/** The largest m of Linear at that n; 0 if there will be none. Built in and defined alike. A recipe of
    Linear that completes readings may ask for more: GLIMPSE_STATUS_COMPONENTS says so. */
#ifndef GLIMPSE_COMPONENTS
#define GLIMPSE_COMPONENTS 60
#endif

/** What the models take. A library of one model (cargo's feature only-neural, ...) takes less: then
    define GLIMPSE_ONLY_NEURAL, or its likes, before this file. */
#if defined(GLIMPSE_ONLY_PHONG)
#define GLIMPSE_MODEL_BYTES 1720
#elif defined(GLIMPSE_ONLY_COOK_TORRANCE)
#define GLIMPSE_MODEL_BYTES 1728
#elif defined(GLIMPSE_ONLY_NEURAL)
#define GLIMPSE_MODEL_BYTES 5400
#elif defined(GLIMPSE_ONLY_LINEAR)
#define GLIMPSE_MODEL_BYTES (4 * GLIMPSE_LINEAR_WORDS_)
#else
#define GLIMPSE_MODEL_BYTES (8848 + 4 * GLIMPSE_LINEAR_WORDS_)
#endif

#define GLIMPSE_RANK_ \
    (GLIMPSE_SAMPLES < GLIMPSE_COMPONENTS ? GLIMPSE_SAMPLES : GLIMPSE_COMPONENTS)
#define GLIMPSE_LINEAR_WORDS_ \
    (5 * GLIMPSE_COMPONENTS + GLIMPSE_SAMPLES + GLIMPSE_RANK_ * (GLIMPSE_RANK_ + 7) / 2)

/** How the memory of a scan or driver is aligned, in bytes. */
#define GLIMPSE_ALIGNMENT 8

/** Bytes of memory that a scan takes. */
#define GLIMPSE_SCAN_BYTES \
    (38 * GLIMPSE_SAMPLES + GLIMPSE_MODEL_BYTES + 48 * sizeof(void *) + 64)

/** Bytes of memory that a driver takes. */
#define GLIMPSE_DRIVER_BYTES (GLIMPSE_SCAN_BYTES + 1024)

/** Declares memory: GLIMPSE_MEMORY(memory, GLIMPSE_SCAN_BYTES); or static GLIMPSE_MEMORY(...); */
#ifdef __cplusplus
#define GLIMPSE_MEMORY(name, bytes) unsigned char name alignas(GLIMPSE_ALIGNMENT)[bytes]
#else
#define GLIMPSE_MEMORY(name, bytes) _Alignas(GLIMPSE_ALIGNMENT) unsigned char name[bytes]
#endif

/**
 * What every function returns: 0 if all went well. glimpse_status_text() has a sentence for each,
 * with what helps.
 *
 * After anything else than GLIMPSE_STATUS_OK nothing has changed and no result was written, unless a
 * function says otherwise. Numbers are never given to something else.
 */
enum glimpse_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * All went well.
     */
    GLIMPSE_STATUS_OK = 0,
    /**
     * A pointer is null that must not be.
     */
    GLIMPSE_STATUS_NULL = 1,
    /**
     * A pointer is not aligned as its type asks, or memory not to GLIMPSE_ALIGNMENT.
     */
    GLIMPSE_STATUS_MISALIGNED = 2,
    /**
     * The memory has fewer bytes than the library was built for.
     */
    GLIMPSE_STATUS_MEMORY_TOO_SMALL = 3,
    /**
     * A length is larger than memory can be.
     */
    GLIMPSE_STATUS_LENGTH = 4,
    /**
     * The buffer has no room for the result.
     */
    GLIMPSE_STATUS_BUFFER_TOO_SMALL = 5,
    /**
     * An argument is none of the values that it can have.
     */
    GLIMPSE_STATUS_ARGUMENT = 6,
    /**
     * There is no sample left to read; this ends a loop.
     */
    GLIMPSE_STATUS_NONE_PENDING = 16,
    /**
     * This sample was not read yet.
     */
    GLIMPSE_STATUS_NOT_READ = 17,
    /**
     * A reading is missing.
     */
    GLIMPSE_STATUS_INCOMPLETE = 18,
    /**
     * No fit is under way.
     */
    GLIMPSE_STATUS_NO_FIT = 19,
    /**
     * The fit is not complete.
     */
    GLIMPSE_STATUS_UNFINISHED = 20,
    /**
     * No fit has ended since the last reading.
     */
    GLIMPSE_STATUS_NOT_FITTED = 21,
    /**
     * The driver has no scan, since its recipe was refused.
     */
    GLIMPSE_STATUS_NO_SCAN = 22,
    /**
     * The bytes are no recipe.
     */
    GLIMPSE_STATUS_RECIPE_MAGIC = 32,
    /**
     * The recipe has a format that this library does not read.
     */
    GLIMPSE_STATUS_RECIPE_VERSION = 33,
    /**
     * The recipe was cut or padded.
     */
    GLIMPSE_STATUS_RECIPE_LENGTH = 34,
    /**
     * The recipe's bytes were altered.
     */
    GLIMPSE_STATUS_RECIPE_CHECKSUM = 35,
    /**
     * The recipe's body does not follow the format.
     */
    GLIMPSE_STATUS_RECIPE_MALFORMED = 36,
    /**
     * A field of the recipe has an impossible count.
     */
    GLIMPSE_STATUS_RECIPE_COUNT = 37,
    /**
     * A field of the recipe holds a NaN or an infinity.
     */
    GLIMPSE_STATUS_RECIPE_NON_FINITE = 38,
    /**
     * A direction of the recipe's pattern is below the horizon.
     */
    GLIMPSE_STATUS_RECIPE_BELOW_HORIZON = 39,
    /**
     * The recipe is a descent, of a model that is not fitted by one.
     */
    GLIMPSE_STATUS_RECIPE_MODEL = 40,
    /**
     * A field of the recipe holds 0 or less, where numbers have to be positive.
     */
    GLIMPSE_STATUS_RECIPE_NOT_POSITIVE = 41,
    /**
     * A field of the recipe holds a negative number.
     */
    GLIMPSE_STATUS_RECIPE_NEGATIVE = 42,
    /**
     * A field of the recipe holds a number outside of its range.
     */
    GLIMPSE_STATUS_RECIPE_RANGE = 43,
    /**
     * The limits that the recipe states are none.
     */
    GLIMPSE_STATUS_RECIPE_LIMITS = 44,
    /**
     * The recipe has a section that this library does not know, and that it cannot do without.
     */
    GLIMPSE_STATUS_RECIPE_UNKNOWN = 45,
    /**
     * The recipe's sections are not those that a recipe has.
     */
    GLIMPSE_STATUS_RECIPE_SECTIONS = 46,
    /**
     * The recipe is for another model than this library.
     */
    GLIMPSE_STATUS_MODEL = 48,
    /**
     * The recipe has more samples than there is room for.
     */
    GLIMPSE_STATUS_SAMPLES = 49,
    /**
     * The recipe has more components than there is room for.
     */
    GLIMPSE_STATUS_COMPONENTS = 50,
    /**
     * The basis is not the recipe's.
     */
    GLIMPSE_STATUS_BASIS = 51,
    /**
     * The bytes are no compact basis.
     */
    GLIMPSE_STATUS_BASIS_MAGIC = 52,
    /**
     * The basis has a format that this library does not read.
     */
    GLIMPSE_STATUS_BASIS_VERSION = 53,
    /**
     * The basis was cut or padded.
     */
    GLIMPSE_STATUS_BASIS_LENGTH = 54,
    /**
     * The basis's bytes were altered.
     */
    GLIMPSE_STATUS_BASIS_CHECKSUM = 55,
    /**
     * The basis has an impossible count or scale.
     */
    GLIMPSE_STATUS_BASIS_MALFORMED = 56,
    /**
     * A channel of the reading is NaN or infinite.
     */
    GLIMPSE_STATUS_READING_NON_FINITE = 64,
    /**
     * A channel of the reading is further below 0 than noise can be.
     */
    GLIMPSE_STATUS_READING_NEGATIVE = 65,
    /**
     * The recipe has no sample with this index.
     */
    GLIMPSE_STATUS_READING_INDEX = 66,
    /**
     * The readings are too large for a BRDF.
     */
    GLIMPSE_STATUS_IMPLAUSIBLE = 80,
    /**
     * The fit diverged.
     */
    GLIMPSE_STATUS_DIVERGED = 81,
    /**
     * A direction is below the horizon, not finite or not of unit length.
     */
    GLIMPSE_STATUS_DIRECTIONS = 82,
    /**
     * Linear's BRDF cannot be told without a basis.
     */
    GLIMPSE_STATUS_NO_BASIS = 83,
    /**
     * The device's own arms or sensor failed.
     */
    GLIMPSE_STATUS_MACHINE = 96,
    /**
     * The host speaks another version of the protocol.
     */
    GLIMPSE_STATUS_PROTOCOL = 97,
    /**
     * The host does not reply.
     */
    GLIMPSE_STATUS_NO_REPLY = 98,
    /**
     * The host refused: no scan has begun.
     */
    GLIMPSE_STATUS_REFUSED_NO_SCAN = 99,
    /**
     * The host refused: it cannot reach these directions.
     */
    GLIMPSE_STATUS_REFUSED_DIRECTIONS = 100,
    /**
     * The host refused: the model has another number of values.
     */
    GLIMPSE_STATUS_REFUSED_VALUES = 101,
    /**
     * The host refused: it cannot do with this model.
     */
    GLIMPSE_STATUS_REFUSED_MODEL = 102,
    /**
     * The host refused: it did not give this reading.
     */
    GLIMPSE_STATUS_REFUSED_KEPT = 103,
    /**
     * The host refused: it sends another recipe than it offered.
     */
    GLIMPSE_STATUS_REFUSED_RECIPE = 104,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_status glimpse_status;
#else
typedef int32_t glimpse_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The reflectance models.
 */
enum glimpse_model
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Phong: 7 values.
     */
    GLIMPSE_MODEL_PHONG = 0,
    /**
     * A network: 675 values.
     */
    GLIMPSE_MODEL_NEURAL = 1,
    /**
     * Cook-Torrance: 8 values.
     */
    GLIMPSE_MODEL_COOK_TORRANCE = 2,
    /**
     * Principal components: 3 m values, m for red, m for green, m for blue.
     */
    GLIMPSE_MODEL_LINEAR = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_model glimpse_model;
#else
typedef int32_t glimpse_model;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What a firmware has to do next.
 */
enum glimpse_action_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Nothing, until a byte comes, one can be sent, or `milliseconds` have passed (UINT32_MAX: until
     * glimpse_driver_restart()).
     */
    GLIMPSE_ACTION_KIND_WAIT = 0,
    /**
     * Nothing but to call again soon.
     */
    GLIMPSE_ACTION_KIND_CONTINUE = 1,
    /**
     * Move the arms to `directions`, read the sensor, then glimpse_driver_record() with `index`, or
     * glimpse_driver_fail(). Any other pending sample will do too. It is said again until then.
     */
    GLIMPSE_ACTION_KIND_MEASURE = 2,
    /**
     * Keep `index` and `reading` where a reset leaves them.
     */
    GLIMPSE_ACTION_KIND_SAVE = 3,
    /**
     * Forget all readings that were kept.
     */
    GLIMPSE_ACTION_KIND_FORGET = 4,
    /**
     * Write `byte_count` of `bytes` to `offset` of a new recipe, where the present one is not. At 0
     * another recipe begins.
     */
    GLIMPSE_ACTION_KIND_STORE = 5,
    /**
     * The new recipe of `offset` bytes is stored, and should have `checksum`. If
     * glimpse_recipe_describe() accepts it, begin a driver by it; else glimpse_driver_reject().
     */
    GLIMPSE_ACTION_KIND_INSTALL = 6,
    /**
     * The scan is done, with `residual`; until the next poll glimpse_driver_scan() has the material.
     */
    GLIMPSE_ACTION_KIND_FINISHED = 7,
    /**
     * The scan is given up, because of `failure`. It begins anew by itself where a host measures or
     * listens, else by glimpse_driver_restart().
     */
    GLIMPSE_ACTION_KIND_FAILED = 8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_action_kind glimpse_action_kind;
#else
typedef int32_t glimpse_action_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Who is at the other end of the line, and who moves the arms.
 */
enum glimpse_host
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * A host moves the arms and reads the sensor; the device asks it to.
     */
    GLIMPSE_HOST_MEASURES = 0,
    /**
     * The device moves the arms; a host hears how far it is, and the result.
     */
    GLIMPSE_HOST_LISTENS = 1,
    /**
     * The device moves the arms, and nobody is there.
     */
    GLIMPSE_HOST_ABSENT = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_host glimpse_host;
#else
typedef int32_t glimpse_host;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Leads scans from the first word to the last, in the caller's memory: it is fed with bytes from
 * the line, readings and elapsed time, and says what is to be done next. Motors, sensor, line, flash
 * and clock are the firmware's. It is used by one thread at a time, and by no interrupt that may come
 * during a call.
 */
typedef struct glimpse_driver glimpse_driver;

/**
 * A scan of one material, in the caller's memory. It is used by one thread at a time.
 */
typedef struct glimpse_scan glimpse_scan;

/**
 * A pair of directions of unit length, pointing away from the surface; z is its normal.
 */
typedef struct glimpse_directions {
    /**
     * Towards the light: x, y, z.
     */
    float incoming[3];
    /**
     * Towards the sensor: x, y, z.
     */
    float outgoing[3];
} glimpse_directions;

/**
 * Where both arms stand, as spherical angles in radians: theta from the normal, phi about it, from x
 * towards y.
 */
typedef struct glimpse_arms {
    /**
     * The light's: 0 to pi/2.
     */
    float theta_i;
    /**
     * The light's; any turn. 0 along the normal.
     */
    float phi_i;
    /**
     * The sensor's: 0 to pi/2.
     */
    float theta_o;
    /**
     * The sensor's; any turn. 0 along the normal.
     */
    float phi_o;
} glimpse_arms;

/**
 * What is in a recipe.
 */
typedef struct glimpse_recipe {
    /**
     * The model that it fits.
     */
    glimpse_model model;
    /**
     * n, how many samples its pattern has.
     */
    uint16_t samples;
    /**
     * How many values a fit by it has.
     */
    uint16_t values;
    /**
     * The CRC-32 in its header, which names it: readings that outlast a reset belong to one recipe.
     */
    uint32_t checksum;
    /**
     * The loss to expect on a material that training never saw; NaN if the recipe states none.
     */
    float expected_loss;
} glimpse_recipe;

/**
 * Where a sample of the recipe's pattern is.
 */
typedef struct glimpse_sample {
    /**
     * Index in the pattern, from 0.
     */
    uint16_t index;
    /**
     * Where the light and the sensor have to be. The half vector lies in the xz plane; an isotropic
     * material does not notice if both azimuths are turned together.
     */
    struct glimpse_directions directions;
    /**
     * The same as spherical angles.
     */
    struct glimpse_arms arms;
    /**
     * The same in Rusinkiewicz angles, radians. Between the normal and the half vector: 0 to pi/2.
     */
    float theta_h;
    /**
     * Between the half vector and the light: 0 to pi/2.
     */
    float theta_d;
    /**
     * The light's azimuth about the half vector.
     */
    float phi_d;
} glimpse_sample;

/**
 * What the sensor saw.
 */
typedef struct glimpse_reading {
    /**
     * The BRDF, linear red, green and blue, in sr^-1: not times the cosine, not counts, not a
     * reflectance factor. Noise may bring it slightly below 0, to -1 at most. A sensor with one
     * channel gives it three times.
     */
    float brdf[3];
    /**
     * Not 0 if the sensor was saturated, so that the true value is larger.
     */
    uint8_t saturated;
} glimpse_reading;

/**
 * What became of a reading.
 */
typedef struct glimpse_recorded {
    /**
     * 1 if it took the place of an earlier one, else 0.
     */
    uint8_t replaced;
    /**
     * 1 if a channel was so far below 0 that the fit brings it up to what the loss can take, else 0.
     */
    uint8_t clamped;
} glimpse_recorded;

/**
 * How far a fit is, in units of work: gradients of one sample, for Linear rows and channels of
 * its solve, or parts of a completion of the readings.
 */
typedef struct glimpse_progress {
    /**
     * Units done.
     */
    uint32_t done;
    /**
     * Units that the whole fit takes: it is complete when done is total.
     */
    uint32_t total;
} glimpse_progress;

/**
 * How well a fit explains its readings. It cannot see a wrong convention: readings that are times
 * the cosine are fitted as well as others.
 */
typedef struct glimpse_residual {
    /**
     * The mean cosine-weighted logarithmic error over the readings.
     */
    float mean;
    /**
     * The largest error of a reading.
     */
    float worst;
    /**
     * Its index.
     */
    uint16_t worst_index;
    /**
     * How many readings were saturated.
     */
    uint16_t saturated;
    /**
     * How many readings were the one before them, bit for bit. A real sensor is too noisy for that;
     * if all but the first were, it is stuck.
     */
    uint16_t repeated;
    /**
     * How many readings were too far below 0, and were brought up.
     */
    uint16_t clamped;
} glimpse_residual;

/**
 * How a driver behaves. glimpse_config_default() has what serves most.
 */
typedef struct glimpse_config {
    /**
     * One of glimpse_host.
     */
    int32_t host;
    /**
     * Units of the fit in one glimpse_driver_poll().
     */
    uint32_t slice;
    /**
     * A request that has no reply is sent again after so many milliseconds.
     */
    uint32_t repeat;
    /**
     * A host that does not reply for so many milliseconds has fallen silent.
     */
    uint32_t patience;
    /**
     * The same while its motors move.
     */
    uint32_t measuring_patience;
    /**
     * The device can store recipes of at most so many bytes; 0 if it cannot.
     */
    uint32_t recipe_bytes;
    /**
     * How often a reading is taken that cannot be one before the scan is given up.
     */
    uint8_t attempts;
} glimpse_config;

/**
 * A reading that outlasted a reset.
 */
typedef struct glimpse_kept {
    /**
     * Index of the sample in the recipe's pattern.
     */
    uint16_t index;
    /**
     * What the sensor saw.
     */
    struct glimpse_reading reading;
} glimpse_kept;

/**
 * What a firmware has to do next. What its kind does not name is 0.
 */
typedef struct glimpse_action {
    /**
     * What is to be done.
     */
    glimpse_action_kind kind;
    /**
     * Why a scan is given up.
     */
    glimpse_status failure;
    /**
     * How long nothing is to be done.
     */
    uint32_t milliseconds;
    /**
     * Where in a new recipe bytes belong; or its length.
     */
    uint32_t offset;
    /**
     * The checksum that a new recipe should have in its header.
     */
    uint32_t checksum;
    /**
     * Where to measure.
     */
    struct glimpse_directions directions;
    /**
     * What to keep.
     */
    struct glimpse_reading reading;
    /**
     * How well the fit explains its readings.
     */
    struct glimpse_residual residual;
    /**
     * Index of a sample.
     */
    uint16_t index;
    /**
     * How many bytes there are to store.
     */
    uint16_t byte_count;
    /**
     * What to store.
     */
    uint8_t bytes[60];
} glimpse_action;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * A sentence in English that says what a status means and what helps. It ends in a zero, is
 * constant and never null; for a number that is no status it says so.
 */
const char *glimpse_status_text(int32_t status);

/**
 * The version of this library, as "0.2.0"; GLIMPSE_VERSION is the header's, and should be the same. It
 * ends in a zero, is constant and never null.
 */
const char *glimpse_version(void);

/**
 * The directions of two arms. All angles will do; what is below the horizon has no BRDF.
 */
struct glimpse_directions glimpse_directions_of(struct glimpse_arms arms);

/**
 * Checks a recipe, and whether this library was built for it; says what is in it.
 *
 * @param bytes   The recipe, which trainer wrote; of any alignment, in flash or in RAM.
 * @param count   How many bytes these are.
 * @param recipe  What is in it.
 * @return GLIMPSE_STATUS_RECIPE_...: the bytes are no whole recipe. GLIMPSE_STATUS_MODEL,
 *         GLIMPSE_STATUS_SAMPLES, GLIMPSE_STATUS_COMPONENTS: it is one, but not for this library.
 */
glimpse_status glimpse_recipe_describe(const uint8_t *bytes,
                                       size_t count,
                                       struct glimpse_recipe *recipe);

/**
 * How many bytes of memory glimpse_scan_begin() takes as the library was built;
 * GLIMPSE_SCAN_BYTES is no less if C's macros say the same.
 */
size_t glimpse_scan_bytes(void);

/**
 * Begins a scan. Whatever the memory held is overwritten, also if the scan cannot begin; it needs no
 * initialization.
 *
 * @param memory        GLIMPSE_SCAN_BYTES of the caller's memory, aligned to GLIMPSE_ALIGNMENT, as
 *                      GLIMPSE_MEMORY declares it. Until the caller has done with the scan nothing
 *                      else may read or write it, nor may it be moved. There is nothing to free.
 * @param memory_bytes  How many bytes that are.
 * @param recipe        The recipe, of any alignment. It is not copied: it has to stay as it is for
 *                      as long as the scan is used. It must not lie in the scan's memory.
 * @param recipe_bytes  How many bytes that are.
 * @param scan          The handle that the other functions take: a pointer into the memory. Null if
 *                      the scan could not begin.
 * @return As glimpse_recipe_describe(), and GLIMPSE_STATUS_MEMORY_TOO_SMALL.
 */
glimpse_status glimpse_scan_begin(void *memory,
                                  size_t memory_bytes,
                                  const uint8_t *recipe,
                                  size_t recipe_bytes,
                                  struct glimpse_scan **scan);

/**
 * Gives Linear the basis by which glimpse_fitted_brdf() answers; the other models have no use for it.
 * It is checked whole, which takes some milliseconds for each 100 kB.
 *
 * @param scan   The scan.
 * @param basis  What trainer export --format basis wrote, of any alignment. It is not copied: it has
 *               to stay as it is for as long as the scan is used.
 * @param count  How many bytes that are.
 * @return GLIMPSE_STATUS_BASIS_...: the bytes are no whole basis. GLIMPSE_STATUS_BASIS: it is another
 *         one than the recipe names.
 */
glimpse_status glimpse_scan_set_basis(struct glimpse_scan *scan,
                                      const uint8_t *basis,
                                      size_t count);

/**
 * Forgets all readings, for the next material.
 */
glimpse_status glimpse_scan_restart(struct glimpse_scan *scan);

/**
 * The next sample that was not read yet, in the recipe's order. They may be read in any order.
 *
 * @param scan    The scan.
 * @param from    The least index that will do; 0 for the first sample that is left.
 * @param sample  Where to measure.
 * @return GLIMPSE_STATUS_NONE_PENDING if there is none.
 */
glimpse_status glimpse_scan_next(const struct glimpse_scan *scan,
                                 uint16_t from,
                                 struct glimpse_sample *sample);

/**
 * Takes the reading of a sample, in any order. A second reading of the same sample replaces the
 * first; a fit that was under way, or its result, is given up.
 *
 * @param scan      The scan.
 * @param index     Which sample of the pattern it is.
 * @param reading   What the sensor saw; it is copied.
 * @param recorded  What became of it, or null.
 * @return GLIMPSE_STATUS_READING_...: it cannot be a reading, and has to be taken again.
 */
glimpse_status glimpse_scan_record(struct glimpse_scan *scan,
                                   uint16_t index,
                                   const struct glimpse_reading *reading,
                                   struct glimpse_recorded *recorded);

/**
 * The reading of a sample. (A fit brings what is too far below 0 up to what the loss can take.)
 *
 * @param scan     The scan.
 * @param index    Which sample of the pattern.
 * @param reading  What was recorded.
 * @return GLIMPSE_STATUS_NOT_READ if there is none, or no such sample.
 */
glimpse_status glimpse_scan_reading(const struct glimpse_scan *scan,
                                    uint16_t index,
                                    struct glimpse_reading *reading);

/**
 * Begins a fit of all readings. One that was under way, or has ended, is forgotten.
 *
 * Where the recipe can do without some of them, those that are missing or saturated are left out, as
 * long as there is one to go by: a fit may begin after the first reading, and again after each
 * further one.
 *
 * @param scan  The scan.
 * @return GLIMPSE_STATUS_INCOMPLETE if a reading is missing that the recipe cannot do without,
 *         GLIMPSE_STATUS_IMPLAUSIBLE if the readings are no BRDF's, as a sensor's raw counts.
 */
glimpse_status glimpse_fit_begin(struct glimpse_scan *scan);

/**
 * Goes on with the fit. The result does not depend on the budgets.
 *
 * @param scan      The scan.
 * @param budget    Units of work that are done at most: 8 are some milliseconds on a Cortex-M4F at
 *                  168 MHz for the slowest model. UINT32_MAX does all of it.
 * @param progress  How far it is, or null.
 * @return GLIMPSE_STATUS_NO_FIT if none was begun.
 */
glimpse_status glimpse_fit_advance(struct glimpse_scan *scan,
                                   uint32_t budget,
                                   struct glimpse_progress *progress);

/**
 * Ends a complete fit: looks at every value, and at the fitted material at every reading.
 *
 * @param scan      The scan.
 * @param residual  How well the fit explains the readings, or null.
 * @return GLIMPSE_STATUS_NO_FIT if none is under way, GLIMPSE_STATUS_UNFINISHED if it is not
 *         complete, GLIMPSE_STATUS_DIVERGED if a number is not finite: then the readings are still
 *         there, and no fit is under way any more.
 */
glimpse_status glimpse_fit_finish(struct glimpse_scan *scan, struct glimpse_residual *residual);

/**
 * How well the last fit explains its readings.
 *
 * @param scan      The scan.
 * @param residual  The residual.
 * @return GLIMPSE_STATUS_NOT_FITTED if no fit has ended since the last reading.
 */
glimpse_status glimpse_fitted_residual(const struct glimpse_scan *scan,
                                       struct glimpse_residual *residual);

/**
 * The loss that the last fit is likely to have, by its readings: an error bar for this material, where
 * the recipe predicts one, as those that complete readings do.
 *
 * @param scan  The scan.
 * @param loss  The mean of ln(1 + f cos(theta_i)) that is likely to be missed; NAN if the recipe
 *              predicts none, or more than a number can hold.
 * @return GLIMPSE_STATUS_NOT_FITTED if no fit has ended since the last reading.
 */
glimpse_status glimpse_fitted_predicted_loss(const struct glimpse_scan *scan,
                                             float *loss);

/**
 * The fitted material's BRDF.
 *
 * @param scan        The scan.
 * @param directions  Where: two directions of unit length above the horizon.
 * @param brdf        Linear red, green and blue, in sr^-1, not times the cosine.
 * @return GLIMPSE_STATUS_NOT_FITTED, GLIMPSE_STATUS_DIRECTIONS, and for Linear
 *         GLIMPSE_STATUS_NO_BASIS: see glimpse_scan_set_basis(), or have a host make it from the values;
 *         or by its basis GLIMPSE_STATUS_DIVERGED: it is more than a number can hold.
 */
glimpse_status glimpse_fitted_brdf(const struct glimpse_scan *scan,
                                   const struct glimpse_directions *directions,
                                   float (*brdf)[3]);

/**
 * The fitted values, all finite: the model's parameters in its order, or Linear's coefficients, m
 * for red, m for green, m for blue. A host makes pictures of them.
 *
 * @param scan      The scan.
 * @param values    Room for them; may be null if capacity is 0.
 * @param capacity  For how many.
 * @param count     How many there are; this is written if GLIMPSE_STATUS_BUFFER_TOO_SMALL is returned
 *                  too.
 * @return GLIMPSE_STATUS_NOT_FITTED, GLIMPSE_STATUS_BUFFER_TOO_SMALL.
 */
glimpse_status glimpse_fitted_values(const struct glimpse_scan *scan,
                                     float *values,
                                     size_t capacity,
                                     size_t *count);

/**
 * How many bytes of memory glimpse_driver_begin() takes as the library was built;
 * GLIMPSE_DRIVER_BYTES is no less if C's macros say the same.
 */
size_t glimpse_driver_bytes(void);

/**
 * What serves most: slices of 8 units, repeats after 0.1 s, patience of 2 s, of a minute for
 * readings, three attempts, no storage for recipes.
 */
struct glimpse_config glimpse_config_default(int32_t host);

/**
 * Begins. Memory and recipe are as for glimpse_scan_begin().
 *
 * A recipe that is damaged, or for another library, is no error here: the driver tells the host why,
 * asks it for a better one if it can store one, and says GLIMPSE_ACTION_KIND_FAILED. Without a
 * recipe at all let recipe be null and recipe_bytes 0.
 *
 * @param memory        GLIMPSE_DRIVER_BYTES, aligned to GLIMPSE_ALIGNMENT.
 * @param memory_bytes  How many bytes that are.
 * @param recipe        The recipe, which stays as it is while the driver is used.
 * @param recipe_bytes  How many bytes that are.
 * @param config        How it behaves; it is copied.
 * @param kept          Readings by this recipe (see glimpse_recipe.checksum) that outlasted a reset;
 *                      they are copied, and a host that measures is asked whether they still hold.
 *                      What cannot be a reading is left out. May be null if there are none.
 * @param kept_count    How many there are.
 * @param driver        The handle: a pointer into the memory. Null if there was an error.
 * @return GLIMPSE_STATUS_MEMORY_TOO_SMALL, GLIMPSE_STATUS_ARGUMENT if there is no such host.
 */
glimpse_status glimpse_driver_begin(void *memory,
                                    size_t memory_bytes,
                                    const uint8_t *recipe,
                                    size_t recipe_bytes,
                                    const struct glimpse_config *config,
                                    const struct glimpse_kept *kept,
                                    size_t kept_count,
                                    struct glimpse_driver **driver);

/**
 * Does what is next, and says what the firmware has to do. It is called again and again, and takes
 * no longer than a slice of the fit.
 *
 * @param driver   The driver.
 * @param elapsed  Milliseconds since the last call; measured from call to call, so that roundings do
 *                 not add up.
 * @param action   What is to be done.
 */
glimpse_status glimpse_driver_poll(struct glimpse_driver *driver,
                                   uint32_t elapsed,
                                   struct glimpse_action *action);

/**
 * Takes bytes from the line, all of them.
 *
 * @param driver  The driver.
 * @param bytes   What was received; may be null if count is 0.
 * @param count   How many bytes that are.
 */
glimpse_status glimpse_driver_receive(struct glimpse_driver *driver,
                                      const uint8_t *bytes,
                                      size_t count);

/**
 * Bytes to be sent, none or more. glimpse_driver_sent() says how many were; in between no other
 * function of this driver may be called that changes it.
 *
 * @param driver  The driver.
 * @param bytes   Where they are: in the driver's memory, to be read only.
 * @param count   How many there are.
 */
glimpse_status glimpse_driver_outgoing(const struct glimpse_driver *driver,
                                       const uint8_t **bytes,
                                       size_t *count);

/**
 * So many of the outgoing bytes were sent.
 *
 * @param driver  The driver.
 * @param count   How many; more than there are count as all.
 */
glimpse_status glimpse_driver_sent(struct glimpse_driver *driver, size_t count);

/**
 * Takes a reading of the device's own sensor. What cannot be one is asked for again, as often as
 * glimpse_config.attempts says.
 *
 * @param driver   The driver.
 * @param index    Which sample of the pattern it is.
 * @param reading  What the sensor saw; it is copied.
 * @return GLIMPSE_STATUS_NO_SCAN if the driver has none.
 */
glimpse_status glimpse_driver_record(struct glimpse_driver *driver,
                                     uint16_t index,
                                     const struct glimpse_reading *reading);

/**
 * Gives up on the scan, since the device's own arms or sensor failed.
 */
glimpse_status glimpse_driver_fail(struct glimpse_driver *driver);

/**
 * Tells the host why the recipe that it sent is none: after GLIMPSE_ACTION_KIND_INSTALL, if
 * glimpse_recipe_describe() refused it. The present recipe stays in use.
 *
 * @param driver  The driver.
 * @param recipe  What was stored.
 * @param count   How many bytes that are.
 * @return GLIMPSE_STATUS_ARGUMENT if glimpse_recipe_describe() accepts it: then nothing has changed.
 */
glimpse_status glimpse_driver_reject(struct glimpse_driver *driver,
                                     const uint8_t *recipe,
                                     size_t count);

/**
 * Begins a scan of the next material.
 */
glimpse_status glimpse_driver_restart(struct glimpse_driver *driver);

/**
 * The driver's scan, to look at: for those functions that take a const glimpse_scan. It must not be
 * changed, and is there until the next call that changes the driver.
 *
 * @param driver  The driver.
 * @param scan    The scan; null if there is none.
 * @return GLIMPSE_STATUS_NO_SCAN if the driver has none, since its recipe was refused.
 */
glimpse_status glimpse_driver_scan(const struct glimpse_driver *driver,
                                   const struct glimpse_scan **scan);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* GLIMPSE_H */
