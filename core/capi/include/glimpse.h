/*
 * Glimpse for firmware in C: measures the reflectance (BRDF) of a material in the few directions of a
 * recipe, and fits a model to the readings.
 *
 *     static GLIMPSE_MEMORY(memory, GLIMPSE_SCAN_BYTES(RECIPE_WORDS));
 *
 *     glimpse_scan_begin(memory, sizeof memory, recipe, recipe_bytes, &scan);
 *     while (glimpse_scan_next(scan, 0, &sample) == GLIMPSE_STATUS_OK) {
 *         ... move the arms to sample.directions and read the sensor ...
 *         glimpse_scan_record(scan, sample.index, &reading, NULL);
 *     }
 *     glimpse_fit_begin(scan);
 *     do glimpse_fit_advance(scan, 8, &progress); while (progress.done < progress.total);
 *     glimpse_fit_finish(scan);
 *     glimpse_fitted_brdf(scan, &directions, &brdf);
 *
 * Rules for all functions:
 * - Directions are unit vectors that point away from the surface. The z axis is the surface normal. Angles
 *   are in radians. A BRDF is in linear RGB, in sr^-1, and not times the cosine.
 * - The caller provides the memory. The library does not allocate and has no global state: scans in
 *   different memories are independent, and nothing has to be freed.
 * - Use a scan or driver from one thread at a time, and not from an interrupt handler that may interrupt a
 *   call.
 * - An invalid argument has a negative status that names it. A handle is refused if nothing is in use in its
 *   memory: before begin, after end, after the memory was moved or overwritten, or if the other kind of
 *   handle was begun there. After another begin of the same kind the handle is that of the new one.
 * - The caller guarantees that a pointer that is neither null nor misaligned points to the stated number of
 *   values of its type. Pointers to results must not overlap each other, or the memory of a scan or driver.
 * - No call waits, except in the callbacks of glimpse_flash. The duration of a call depends only on its work.
 *
 * This file is generated from core/capi/src by cbindgen. SPDX-License-Identifier: MIT OR Apache-2.0
 */

#ifndef GLIMPSE_H
#define GLIMPSE_H

#include <stddef.h>
#include <stdint.h>

/** The version of this file; glimpse_version() returns the library's. */
#define GLIMPSE_VERSION "0.3.0"

/** Alignment of the memory of a scan or driver, in bytes. */
#define GLIMPSE_ALIGNMENT 8

/** Bytes of static memory for a scan. The parameter is the recipe's memory in words of 4 bytes, as
    trainer inspect prints it. glimpse_scan_bytes() returns the exact size at run time. */
#define GLIMPSE_SCAN_BYTES(words) (69 * sizeof(void *) + 160 + 4 * (size_t)(words))

/** Bytes of static memory for a driver. glimpse_driver_bytes() returns the exact size at run time. */
#define GLIMPSE_DRIVER_BYTES(words) (GLIMPSE_SCAN_BYTES(words) + 648)

/** The smallest length of an area of glimpse_flash, in bytes, for recipes of up to the given number of
    samples. Round it up to whole sectors. */
#define GLIMPSE_STORE_BYTES(samples) (32 * ((uint32_t)(samples) + 8))

/** Declares memory: static GLIMPSE_MEMORY(memory, GLIMPSE_SCAN_BYTES(1431)); */
#ifdef __cplusplus
#define GLIMPSE_MEMORY(name, bytes) unsigned char name alignas(GLIMPSE_ALIGNMENT)[bytes]
#else
#define GLIMPSE_MEMORY(name, bytes) _Alignas(GLIMPSE_ALIGNMENT) unsigned char name[bytes]
#endif

/**
 * The status of a call: 0 on success. glimpse_status_text() returns its text.
 *
 * A negative status names an invalid argument: the program has a defect. A pointer argument is invalid if
 * it is null although it is required, if it does not have the alignment of its type, or if its array
 * exceeds the address space.
 *
 * After a status other than GLIMPSE_STATUS_OK nothing has changed and no result is written, unless the
 * function states otherwise. The meaning of a number never changes.
 */
enum glimpse_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * argument `scan`: null or misaligned; check the status of glimpse_scan_begin
     */
    GLIMPSE_STATUS_ARGUMENT_SCAN = -1,
    /**
     * argument `driver`: null or misaligned; check the status of glimpse_driver_begin
     */
    GLIMPSE_STATUS_ARGUMENT_DRIVER = -2,
    /**
     * argument `scan` or `driver`: nothing is in use in this memory, or the other kind of handle
     */
    GLIMPSE_STATUS_STALE = -3,
    /**
     * argument `scan`: it belongs to a driver; call functions of the driver to change it
     */
    GLIMPSE_STATUS_READ_ONLY = -4,
    /**
     * argument `memory`: null or misaligned; declare it with GLIMPSE_MEMORY
     */
    GLIMPSE_STATUS_ARGUMENT_MEMORY = -5,
    /**
     * argument `recipe`: null or too long
     */
    GLIMPSE_STATUS_ARGUMENT_RECIPE = -6,
    /**
     * argument `basis`: null or too long
     */
    GLIMPSE_STATUS_ARGUMENT_BASIS = -7,
    /**
     * argument `config`: null or misaligned; start with glimpse_config_default
     */
    GLIMPSE_STATUS_ARGUMENT_CONFIG = -8,
    /**
     * argument `config`: its field `host` is not one of glimpse_host
     */
    GLIMPSE_STATUS_ARGUMENT_HOST = -9,
    /**
     * argument `config`: its field `target_loss` is negative or NAN
     */
    GLIMPSE_STATUS_ARGUMENT_TARGET_LOSS = -10,
    /**
     * argument `machine`, or that field of `config`: null, misaligned, or limits out of range (radians)
     */
    GLIMPSE_STATUS_ARGUMENT_MACHINE = -11,
    /**
     * argument `from`: null or misaligned
     */
    GLIMPSE_STATUS_ARGUMENT_ARMS = -12,
    /**
     * argument `flash`: null or misaligned, or one of its callbacks is null
     */
    GLIMPSE_STATUS_ARGUMENT_FLASH = -13,
    /**
     * argument `reading`: null or misaligned
     */
    GLIMPSE_STATUS_ARGUMENT_READING = -14,
    /**
     * argument `directions` or `at`: null or misaligned
     */
    GLIMPSE_STATUS_ARGUMENT_DIRECTIONS = -15,
    /**
     * argument `bytes`: null or too long
     */
    GLIMPSE_STATUS_ARGUMENT_BYTES = -16,
    /**
     * argument `failure`: neither a failure of the machine (GLIMPSE_STATUS_MACHINE, or 128 to 159) nor GLIMPSE_STATUS_STORAGE
     */
    GLIMPSE_STATUS_ARGUMENT_FAILURE = -17,
    /**
     * argument `calibration`: null, misaligned, or its field `footprint` is not one of glimpse_footprint
     */
    GLIMPSE_STATUS_ARGUMENT_CALIBRATION = -18,
    /**
     * argument `counts`: null or misaligned
     */
    GLIMPSE_STATUS_ARGUMENT_COUNTS = -19,
    /**
     * argument `repeated`: null or misaligned
     */
    GLIMPSE_STATUS_ARGUMENT_REPEATED = -20,
    /**
     * argument `values`: null or misaligned
     */
    GLIMPSE_STATUS_ARGUMENT_VALUES = -21,
    /**
     * argument for a result: null or misaligned
     */
    GLIMPSE_STATUS_ARGUMENT_RESULT = -22,
    /**
     * success
     */
    GLIMPSE_STATUS_OK = 0,
    /**
     * no sample is pending
     */
    GLIMPSE_STATUS_NONE_PENDING = 16,
    /**
     * this sample has no reading
     */
    GLIMPSE_STATUS_NOT_READ = 17,
    /**
     * no fit is under way: glimpse_fit_begin begins one, and a reading ends it
     */
    GLIMPSE_STATUS_NO_FIT = 19,
    /**
     * no fit has been finished since the last reading: call glimpse_fit_finish
     */
    GLIMPSE_STATUS_NOT_FITTED = 21,
    /**
     * Linear has no BRDF without a basis: call glimpse_scan_set_basis, or compute it on a host from the values
     */
    GLIMPSE_STATUS_NO_BASIS = 83,
    /**
     * the buffer is too small for the result: use a larger one
     */
    GLIMPSE_STATUS_BUFFER_TOO_SMALL = 5,
    /**
     * readings are missing: record them
     */
    GLIMPSE_STATUS_INCOMPLETE = 18,
    /**
     * the fit is not complete: advance it until all units are done
     */
    GLIMPSE_STATUS_UNFINISHED = 20,
    /**
     * the scan is finished, has failed, or does not exist: resume or restart it before readings
     */
    GLIMPSE_STATUS_NOT_SCANNING = 22,
    /**
     * the store's areas are too small, beyond the flash, or not whole sectors: change the layout
     */
    GLIMPSE_STATUS_STORE_LAYOUT = 23,
    /**
     * the white is not brighter than dark: check the lamp, and the order of both
     */
    GLIMPSE_STATUS_WHITE_NOT_BRIGHTER = 25,
    /**
     * the white's reflectance is not above 0 and at most 2: give a fraction, not per cent
     */
    GLIMPSE_STATUS_WHITE_REFLECTANCE = 26,
    /**
     * the white is saturated: reduce the exposure of white and sample
     */
    GLIMPSE_STATUS_WHITE_SATURATED = 27,
    /**
     * a channel of dark, white or sample is not a finite number: read it again
     */
    GLIMPSE_STATUS_CHANNEL_NON_FINITE = 28,
    /**
     * the bytes are not a recipe, which starts with GLMP: train one with `trainer train`
     */
    GLIMPSE_STATUS_RECIPE_MAGIC = 32,
    /**
     * the recipe has an unknown format version: train again, or update the firmware
     */
    GLIMPSE_STATUS_RECIPE_VERSION = 33,
    /**
     * the recipe was cut or padded: store all of its bytes again
     */
    GLIMPSE_STATUS_RECIPE_LENGTH = 34,
    /**
     * the recipe's checksum is wrong, because its bytes were altered: store it again
     */
    GLIMPSE_STATUS_RECIPE_CHECKSUM = 35,
    /**
     * the recipe's body does not follow the format: train again
     */
    GLIMPSE_STATUS_RECIPE_MALFORMED = 36,
    /**
     * a field of the recipe has an impossible count: train again
     */
    GLIMPSE_STATUS_RECIPE_COUNT = 37,
    /**
     * a field of the recipe holds a NaN or an infinity: train again
     */
    GLIMPSE_STATUS_RECIPE_NON_FINITE = 38,
    /**
     * a direction of the recipe's pattern is below the horizon: train again
     */
    GLIMPSE_STATUS_RECIPE_BELOW_HORIZON = 39,
    /**
     * a field of the recipe holds a number out of range: train again
     */
    GLIMPSE_STATUS_RECIPE_RANGE = 43,
    /**
     * the machine's limits are invalid: polar angles have to be above 0 and at most pi/2 (radians), the separation from 0 to their sum
     */
    GLIMPSE_STATUS_LIMITS = 44,
    /**
     * the recipe has a required section that the firmware does not know: enable the feature `ridge`, or update the firmware
     */
    GLIMPSE_STATUS_RECIPE_UNKNOWN = 45,
    /**
     * a section of the recipe is missing, out of order, or does not follow the format: train again
     */
    GLIMPSE_STATUS_RECIPE_SECTIONS = 46,
    /**
     * the recipe's header states other sizes than its sections have: train again
     */
    GLIMPSE_STATUS_RECIPE_HEADER = 47,
    /**
     * the recipe's model is not the firmware's: change the firmware's model or the recipe
     */
    GLIMPSE_STATUS_MODEL = 48,
    /**
     * the recipe needs more memory than the firmware has: compute the length with `recipe::memory_words`, or `glimpse_scan_bytes` in C
     */
    GLIMPSE_STATUS_MEMORY = 50,
    /**
     * the basis is not the one that the recipe names: export the recipe's basis, or use none if the recipe names none
     */
    GLIMPSE_STATUS_BASIS = 51,
    /**
     * the bytes are not a compact basis, which starts with GLMC: `trainer export --format basis` writes one
     */
    GLIMPSE_STATUS_BASIS_MAGIC = 52,
    /**
     * the compact basis has an unknown format version: export it again
     */
    GLIMPSE_STATUS_BASIS_VERSION = 53,
    /**
     * the compact basis was cut or padded: export it again
     */
    GLIMPSE_STATUS_BASIS_LENGTH = 54,
    /**
     * the compact basis's checksum is wrong, because its bytes were altered: export it again
     */
    GLIMPSE_STATUS_BASIS_CHECKSUM = 55,
    /**
     * the compact basis has an impossible count or scale: export it again
     */
    GLIMPSE_STATUS_BASIS_MALFORMED = 56,
    /**
     * a channel of the reading is not a finite number: read it again
     */
    GLIMPSE_STATUS_READING_NON_FINITE = 64,
    /**
     * a channel of the reading is below -1 sr^-1, too far below 0 to be noise: check the dark reading
     */
    GLIMPSE_STATUS_READING_NEGATIVE = 65,
    /**
     * the recipe's pattern has no sample with this index: use an index below the number of samples
     */
    GLIMPSE_STATUS_READING_INDEX = 66,
    /**
     * a sample was skipped, but the recipe needs every reading: train one with `--missing`
     */
    GLIMPSE_STATUS_READING_REQUIRED = 67,
    /**
     * more than three quarters of the readings are too large for a BRDF: convert counts or percent to sr^-1
     */
    GLIMPSE_STATUS_READINGS_TOO_LARGE = 80,
    /**
     * the fit diverged, because the recipe describes no material with such readings: check the units (sr^-1, not counts) and the sensor's range
     */
    GLIMPSE_STATUS_DIVERGED = 81,
    /**
     * a direction is not a finite unit vector above the horizon: its length has to be 1 within 0.001, and z positive, along the sample's normal
     */
    GLIMPSE_STATUS_DIRECTIONS = 82,
    /**
     * the readings are not above 0: check the dark reading
     */
    GLIMPSE_STATUS_DARK = 84,
    /**
     * all readings are equal: check that the sensor is not stuck
     */
    GLIMPSE_STATUS_REPEATED = 85,
    /**
     * the red channel reads 0 while others do not: check its filter and amplifier
     */
    GLIMPSE_STATUS_DEAD_RED = 86,
    /**
     * the green channel reads 0 while others do not: check its filter and amplifier
     */
    GLIMPSE_STATUS_DEAD_GREEN = 87,
    /**
     * the blue channel reads 0 while others do not: check its filter and amplifier
     */
    GLIMPSE_STATUS_DEAD_BLUE = 88,
    /**
     * the material reflects several times the light it receives: the readings may be percent, pi times the BRDF, or not divided by the white reading
     */
    GLIMPSE_STATUS_ALBEDO = 89,
    /**
     * the fit explains its readings far worse than expected: check alignment, units and the sensor
     */
    GLIMPSE_STATUS_RESIDUAL = 90,
    /**
     * the readings with the lamp off are too large a part of those with it: check the lamp, darken the room, and calibrate again
     */
    GLIMPSE_STATUS_ROOM_LIGHT = 92,
    /**
     * the sample read again at the end differs: let the lamp warm up, keep the room light constant, and check the axes
     */
    GLIMPSE_STATUS_DRIFT = 93,
    /**
     * too many readings are saturated: reduce the exposure of white and sample
     */
    GLIMPSE_STATUS_SATURATED = 94,
    /**
     * all readings are from before a restart of the device: if the material has changed since, scan it again
     */
    GLIMPSE_STATUS_RESTORED = 95,
    /**
     * the device's own arms or sensor failed: see its log
     */
    GLIMPSE_STATUS_MACHINE = 96,
    /**
     * the host speaks another version of the protocol: update the device or the host
     */
    GLIMPSE_STATUS_PROTOCOL = 97,
    /**
     * the host does not reply: check that it runs, and the line
     */
    GLIMPSE_STATUS_NO_REPLY = 98,
    /**
     * the host refused because no scan has begun: begin again with a hello
     */
    GLIMPSE_STATUS_REFUSED_NO_SCAN = 99,
    /**
     * the host refused because it cannot reach these directions: train within its limits
     */
    GLIMPSE_STATUS_REFUSED_DIRECTIONS = 100,
    /**
     * the host refused because the model has another number of values: update the device or the host
     */
    GLIMPSE_STATUS_REFUSED_VALUES = 101,
    /**
     * the host refused because it does not support this model: use another recipe
     */
    GLIMPSE_STATUS_REFUSED_MODEL = 102,
    /**
     * the host refused because it has not sent this reading: read all samples again
     */
    GLIMPSE_STATUS_REFUSED_RESTORED = 103,
    /**
     * samples of the recipe are out of reach: train within the machine's limits
     */
    GLIMPSE_STATUS_OUT_OF_REACH = 105,
    /**
     * the host refused because it does not support this request: update the host
     */
    GLIMPSE_STATUS_REFUSED_REQUEST = 106,
    /**
     * the flash could not be read, written or erased: check the layout's offset
     */
    GLIMPSE_STATUS_STORAGE = 108,
    /**
     * the frame is too long: use a buffer of `FRAME_BYTES`
     */
    GLIMPSE_STATUS_FRAME_TOO_LONG = 109,
    /**
     * the frame was cut or altered in transit: ignore it, because the device sends it again
     */
    GLIMPSE_STATUS_FRAME_DAMAGED = 110,
    /**
     * the frame holds an unknown message: compare the protocol versions
     */
    GLIMPSE_STATUS_FRAME_UNKNOWN = 111,
    /**
     * the light's polar angle is above the limit `max_theta_i`: choose a direction within reach
     */
    GLIMPSE_STATUS_MAX_THETA_I = 112,
    /**
     * the sensor's polar angle is above the limit `max_theta_o`: choose a direction within reach
     */
    GLIMPSE_STATUS_MAX_THETA_O = 113,
    /**
     * light and sensor are closer than the limit `min_separation`: choose a direction within reach
     */
    GLIMPSE_STATUS_MIN_SEPARATION = 114,
    /**
     * light, normal and sensor are not in one plane, as the limit `in_plane` requires: choose a direction within reach
     */
    GLIMPSE_STATUS_IN_PLANE = 115,
    /**
     * the directions need an axis that the machine lacks, because its speed is 0: choose a direction within reach
     */
    GLIMPSE_STATUS_MISSING_AXIS = 116,
    /**
     * the tile has fewer than three readings: take more
     */
    GLIMPSE_STATUS_TILE_TOO_FEW = 120,
    /**
     * a reading of the tile is not positive and finite, or its directions are not unit vectors above the horizon: read it again, and check the angles of the arms
     */
    GLIMPSE_STATUS_TILE_READING = 121,
    /**
     * the tile's readings scatter about every known quantity: average more of them, and check for stray light, and microsteps and gear of the lamp's polar axis
     */
    GLIMPSE_STATUS_TILE_SPREAD = 122,
    /**
     * more than one quantity explains the tile's readings: spread theta_i and theta_o independently over 0 to 60 degrees, or average more readings
     */
    GLIMPSE_STATUS_TILE_AMBIGUOUS = 123,
    /**
     * the tile's readings are not the BRDF: check the larger spot, and the microsteps, gear and switch of the lamp's polar axis
     */
    GLIMPSE_STATUS_TILE_OTHER = 124,
    /**
     * the operator stopped the arms: go on with a command
     */
    GLIMPSE_STATUS_STOPPED = 128,
    /**
     * steps were lost between two homings: check current, speed and bearings, and read the samples again
     */
    GLIMPSE_STATUS_LOST_STEPS = 129,
    /**
     * the home switch opened away from home: check its contact, and the axis for lost steps
     */
    GLIMPSE_STATUS_SWITCH_OPENED = 130,
    /**
     * the home switch stays open while the axis leaves it: check its wiring (normally closed), the motor's supply, and `reversed`
     */
    GLIMPSE_STATUS_SWITCH_STUCK = 131,
    /**
     * the home switch did not open within the travel: check the motor's supply and the switch; then reset the device
     */
    GLIMPSE_STATUS_SWITCH_NOT_FOUND = 132,
    /**
     * the home switch's contact never settles: check its plug and the cable's shield
     */
    GLIMPSE_STATUS_SWITCH_BOUNCES = 133,
    /**
     * a pin of the axis returned an error: check its configuration
     */
    GLIMPSE_STATUS_PIN = 134,
    /**
     * the arms have to be homed before a move: home them
     */
    GLIMPSE_STATUS_NOT_HOMED = 135,
    /**
     * the arms are moving: wait until they rest
     */
    GLIMPSE_STATUS_MOVING = 136,
    /**
     * no route keeps lamp and sensor apart: check `min_separation`, and the limits of the azimuths
     */
    GLIMPSE_STATUS_NO_SAFE_ROUTE = 137,
    /**
     * the angle is out of the axis's reach: check its limits, and those of the recipe
     */
    GLIMPSE_STATUS_AXIS_REACH = 138,
    /**
     * a field of the axis's settings is out of range: see its documentation
     */
    GLIMPSE_STATUS_AXIS_SETTINGS = 139,
    /**
     * lamp and sensor come closer than `min_separation` while they are homed: move a home switch
     */
    GLIMPSE_STATUS_HOME_TOO_CLOSE = 140,
    /**
     * the far switch is not at its angle: check microsteps, gear and `steps_per_radian`
     */
    GLIMPSE_STATUS_SCALE = 141,
    /**
     * the home switch did not open within 5 degrees of the first move: turn the arm onto its switch by hand with the power off; if it is there, change `reversed`
     */
    GLIMPSE_STATUS_DIRECTION = 142,
    /**
     * the pin of the lamp returned an error: check its configuration
     */
    GLIMPSE_STATUS_LAMP_PIN = 143,
    /**
     * the sensor does not answer: check its wiring and supply
     */
    GLIMPSE_STATUS_SENSOR = 144,
    /**
     * the sensor has lost its settings, or has no valid counts: check its supply
     */
    GLIMPSE_STATUS_SENSOR_RESET = 145,
    /**
     * the sensor's counts stay the same, bit for bit, at different directions: check the sensor
     */
    GLIMPSE_STATUS_SENSOR_STUCK = 146,
    /**
     * the counts with the lamp off are too large: check the lamp's switch, and darken the room
     */
    GLIMPSE_STATUS_LAMP_STUCK = 147,
    /**
     * the device has no calibration: put the white tile on the sample's place, and hold the button
     */
    GLIMPSE_STATUS_NOT_CALIBRATED = 148,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_status glimpse_status;
#else
typedef int32_t glimpse_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * An answer that may be unknown. Compare it with these values: GLIMPSE_ANSWER_UNKNOWN is not 0, either.
 */
enum glimpse_answer
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * No.
     */
    GLIMPSE_ANSWER_NO = 0,
    /**
     * Yes.
     */
    GLIMPSE_ANSWER_YES = 1,
    /**
     * The recipe cannot tell.
     */
    GLIMPSE_ANSWER_UNKNOWN = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_answer glimpse_answer;
#else
typedef int32_t glimpse_answer;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Kinds of glimpse_action. Ignore unknown kinds.
 */
enum glimpse_action_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Sleep until a byte arrives or can be sent, or glimpse_driver_poll_delay() has passed.
     */
    GLIMPSE_ACTION_KIND_WAIT = 0,
    /**
     * Poll again soon.
     */
    GLIMPSE_ACTION_KIND_CONTINUE = 1,
    /**
     * Move the arms to `directions`, read the sensor, then call glimpse_driver_record() with `index`. If only
     * this sample cannot be read, call glimpse_driver_skip(). If arms or sensor failed, call
     * glimpse_driver_fail(). The driver repeats this action until one of these calls.
     *
     * Switch the lamp off if `purpose` is GLIMPSE_PURPOSE_DARK. If it is GLIMPSE_PURPOSE_SAMPLE, the firmware
     * may read any other pending sample instead, such as that of glimpse_machine_nearest().
     */
    GLIMPSE_ACTION_KIND_MEASURE = 2,
    /**
     * Save `reading` of the sample `index` in memory that survives a reset, or without `has_reading` that it
     * was skipped: glimpse_store_save().
     */
    GLIMPSE_ACTION_KIND_SAVE = 3,
    /**
     * Delete all saved readings: glimpse_store_clear(). If this fails, try again before the next scan: a
     * reset would restore them.
     */
    GLIMPSE_ACTION_KIND_FORGET = 4,
    /**
     * The fit is complete, with `residual`. It may be implausible: check residual.implausible first.
     * glimpse_driver_scan() has the fitted material until the next scan.
     *
     * The driver then sends the result to the host, and returns GLIMPSE_ACTION_KIND_FORGET when the host has
     * accepted it. With GLIMPSE_HOST_MEASURES the next scan begins afterwards. Otherwise call
     * glimpse_driver_restart().
     */
    GLIMPSE_ACTION_KIND_FINISHED = 5,
    /**
     * The scan has failed because of `failure`, or its result was refused. The readings are kept, and
     * nothing moves until glimpse_driver_resume() or glimpse_driver_restart().
     */
    GLIMPSE_ACTION_KIND_FAILED = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_action_kind glimpse_action_kind;
#else
typedef int32_t glimpse_action_kind;
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
     * Neural network: 675 values.
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
 * The role of the host.
 */
enum glimpse_host
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * A host moves the arms and reads the sensor, as the device requests.
     */
    GLIMPSE_HOST_MEASURES = 0,
    /**
     * The device moves the arms; a host receives progress and result. The device scans alone if none
     * answers.
     */
    GLIMPSE_HOST_LISTENS = 1,
    /**
     * The device moves the arms, without a host.
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
 * The purpose of a reading.
 */
enum glimpse_purpose
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * A reading for the fit.
     */
    GLIMPSE_PURPOSE_SAMPLE = 0,
    /**
     * A reading with the lamp off: 0, but for room light and noise.
     */
    GLIMPSE_PURPOSE_DARK = 1,
    /**
     * The first sample again: the same reading, unless lamp, room light or axes have drifted.
     */
    GLIMPSE_PURPOSE_AGAIN = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_purpose glimpse_purpose;
#else
typedef int32_t glimpse_purpose;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The larger spot on the sample at all angles, if the white is read at one pair of directions only.
 */
enum glimpse_footprint
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Any: the white is read at the directions of each sample.
     */
    GLIMPSE_FOOTPRINT_ANY = 0,
    /**
     * The light's spot: all that the sensor sees is lit. Counts are proportional to f cos(theta_i).
     */
    GLIMPSE_FOOTPRINT_LIGHT_LARGER = 1,
    /**
     * The sensor's spot: it sees all that is lit. Counts are proportional to f cos(theta_o).
     */
    GLIMPSE_FOOTPRINT_SENSOR_LARGER = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum glimpse_footprint glimpse_footprint;
#else
typedef int32_t glimpse_footprint;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * A driver of scans, in the caller's memory. It takes received bytes, readings and the time, and returns
 * the next action. Motors, sensor, serial line, flash and clock belong to the firmware. Use it from one
 * thread at a time, and not from an interrupt handler that may interrupt a call.
 */
typedef struct glimpse_driver glimpse_driver;

/**
 * A scan of one material, in the caller's memory. Use it from one thread at a time, and not from an
 * interrupt handler that may interrupt a call.
 */
typedef struct glimpse_scan glimpse_scan;

/**
 * Description of a recipe.
 */
typedef struct glimpse_recipe {
    /**
     * The fitted model: one of glimpse_model.
     */
    int32_t model;
    /**
     * n, the number of samples of its pattern.
     */
    uint16_t samples;
    /**
     * Number of values of a fit.
     */
    uint16_t values;
    /**
     * The CRC-32 in its header. It identifies the recipe that saved readings belong to.
     */
    uint32_t checksum;
    /**
     * Expected loss on a material outside of the training set; NaN if the recipe does not include it.
     */
    float expected_loss;
} glimpse_recipe;

/**
 * A pair of unit directions that point away from the surface; z is the normal.
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
 * Positions of both arms as spherical angles in radians: theta from the normal, phi about the normal from
 * x towards y.
 */
typedef struct glimpse_arms {
    /**
     * Polar angle of the light: 0 to pi/2.
     */
    float theta_i;
    /**
     * Azimuth of the light, modulo 2 pi. 0 along the normal.
     */
    float phi_i;
    /**
     * Polar angle of the sensor: 0 to pi/2.
     */
    float theta_o;
    /**
     * Azimuth of the sensor, modulo 2 pi. 0 along the normal.
     */
    float phi_o;
} glimpse_arms;

/**
 * A sample of the recipe's pattern.
 */
typedef struct glimpse_sample {
    /**
     * Index in the pattern, from 0.
     */
    uint16_t index;
    /**
     * Directions of light and sensor. The half vector lies in the xz plane; for an isotropic material
     * both azimuths may be rotated by the same angle.
     */
    struct glimpse_directions directions;
    /**
     * The directions as spherical angles.
     */
    struct glimpse_arms arms;
    /**
     * Rusinkiewicz angle between the normal and the half vector, radians: 0 to pi/2.
     */
    float theta_h;
    /**
     * Rusinkiewicz angle between the half vector and the light, radians: 0 to pi/2.
     */
    float theta_d;
    /**
     * Rusinkiewicz azimuth of the light about the half vector, radians.
     */
    float phi_d;
} glimpse_sample;

/**
 * A reading of the sensor.
 */
typedef struct glimpse_reading {
    /**
     * The BRDF in linear red, green and blue, in sr^-1: not times the cosine, not counts, not a
     * reflectance factor. Values down to -1 are accepted as noise. A sensor with one channel repeats its
     * value three times.
     */
    float brdf[3];
    /**
     * Not 0 if the sensor was saturated: the true value is larger.
     */
    uint8_t saturated;
} glimpse_reading;

/**
 * Details of a recorded reading.
 */
typedef struct glimpse_recorded {
    /**
     * 1 if it replaced an earlier reading, else 0.
     */
    uint8_t replaced;
    /**
     * 1 if the fit will clamp a channel that is too far below 0, else 0.
     */
    uint8_t clamped;
} glimpse_recorded;

/**
 * A place in flash for the readings of a scan: two areas, one after the other. They need no preparation, and
 * nothing else has to survive a reset.
 *
 * After a power cut or an error, the flash has the content before the call of a function or after it. Each
 * function deletes readings of a recipe other than the scan's.
 *
 * The callbacks return 0 on success. They must not call functions of the scan or driver.
 */
typedef struct glimpse_flash {
    /**
     * Passed to the callbacks; may be null.
     */
    void *context;
    /**
     * Reads `count` bytes.
     */
    int (*read)(void *context, uint32_t offset, uint8_t *bytes, size_t count);
    /**
     * Erases the bytes at offsets from `from` to `to` - 1, which are a whole area, to 0xFF.
     */
    int (*erase)(void *context, uint32_t from, uint32_t to);
    /**
     * Writes 32 bytes, at a multiple of 32 bytes from `start`. Each place is written at most once after an
     * erase.
     */
    int (*write)(void *context, uint32_t offset, const uint8_t *bytes, size_t count);
    /**
     * Offset of the first area: a multiple of the length of a sector.
     */
    uint32_t start;
    /**
     * Length of an area: whole sectors, at least GLIMPSE_STORE_BYTES of the recipe's samples. Larger areas
     * are erased less often.
     */
    uint32_t area_bytes;
} glimpse_flash;

/**
 * Progress of a fit in units of work. A unit is the gradient at one sample, one row or channel of Linear's
 * solve, or one part of the completion.
 */
typedef struct glimpse_progress {
    /**
     * Units done.
     */
    uint32_t done;
    /**
     * Units of the whole fit, which is complete when done equals total.
     */
    uint32_t total;
} glimpse_progress;

/**
 * Quality of a fit at its readings. It does not reveal readings with a wrong convention: readings that
 * are wrongly multiplied by the cosine have equally small residuals.
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
     * Index of the reading with the largest error.
     */
    uint16_t worst_index;
    /**
     * Number of saturated readings.
     */
    uint16_t saturated;
    /**
     * Number of readings that equal the previous one bit for bit. A real sensor has noise: if all but the
     * first are equal, the sensor is stuck.
     */
    uint16_t repeated;
    /**
     * Number of readings that were too far below 0 for the loss. The fit clamps them.
     */
    uint16_t clamped;
    /**
     * Reason why the material is implausible: GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_RESTORED
     * (84 to 95). 0 if it is plausible.
     */
    int32_t implausible;
    /**
     * The largest channel of the readings with the lamp off, relative to the mean reading. NAN if it was not
     * read, as without a driver.
     */
    float dark;
    /**
     * The largest change of the first sample, read again at the end, relative to it, or to the mean reading
     * if that is larger. NAN if it was not read.
     */
    float drift;
    /**
     * Number of readings from before a restart of the device. 0 without a driver.
     */
    uint16_t restored;
} glimpse_residual;

/**
 * The fitted material's quality.
 */
typedef struct glimpse_fitted {
    /**
     * The error at the readings.
     */
    struct glimpse_residual residual;
    /**
     * The loss predicted from this material's readings: the mean of
     * |ln(1 + f cos(theta_i)) - ln(1 + f_fitted cos(theta_i))| over all directions. NAN if the recipe does
     * not predict it, or if it is too large for a float.
     */
    float predicted_loss;
    /**
     * The upper bound of that loss, which holds for 90 % of materials. NAN if the recipe does not state it, or
     * if it is too large for a float.
     */
    float loss_bound;
    /**
     * GLIMPSE_ANSWER_YES if the readings are unlike those of all training materials: the predicted loss and
     * its bound are then uncertain.
     */
    glimpse_answer unlike_training;
} glimpse_fitted;

/**
 * Limits of the measuring machine; angles in radians.
 */
typedef struct glimpse_limits {
    /**
     * The largest polar angle of the light's arm: above 0, at most pi/2.
     */
    float max_theta_i;
    /**
     * The largest polar angle of the sensor's arm: above 0, at most pi/2.
     */
    float max_theta_o;
    /**
     * The smallest angle between light and sensor: 0 to pi, and at most the sum of both polar angles above.
     */
    float min_separation;
    /**
     * Not 0 if light, normal and sensor always lie in one plane.
     */
    uint8_t in_plane;
} glimpse_limits;

/**
 * A machine with two arms. glimpse_machine_default() returns one to change.
 */
typedef struct glimpse_machine {
    /**
     * The speed of each axis in rad/s. 0, a negative number or NAN: the machine lacks this axis.
     */
    struct glimpse_arms speeds;
    /**
     * Angles at which the missing axes are fixed. Those of other axes have no effect.
     */
    struct glimpse_arms fixed;
    /**
     * The reach of the arms.
     */
    struct glimpse_limits limits;
    /**
     * Not 0 if the sample is isotropic, so that both azimuths may be turned together.
     */
    uint8_t isotropic;
    /**
     * Not 0 if the arms swing through the normal to negative polar angles. (-theta, phi) is the direction
     * (theta, phi + pi).
     */
    uint8_t through_normal;
} glimpse_machine;

/**
 * A move of the arms to a pending sample.
 */
typedef struct glimpse_move {
    /**
     * Index of the sample in the pattern.
     */
    uint16_t index;
    /**
     * The new position. The azimuths are the nearest to the previous ones. After many moves they may exceed
     * one turn, so that the machine has to unwind its cables.
     */
    struct glimpse_arms arms;
    /**
     * Duration in seconds: that of the axis that takes longest.
     */
    float seconds;
} glimpse_move;

/**
 * Counts of dark and white, with the same lamp and exposure as the sample. A monochrome sensor repeats its
 * numbers three times.
 */
typedef struct glimpse_calibration {
    /**
     * Counts without light.
     */
    float dark[3];
    /**
     * Counts of a white Lambertian tile, above the dark counts.
     */
    float white[3];
    /**
     * The tile's reflectance: above 0, at most 2 (a fraction, not per cent).
     */
    float reflectance[3];
    /**
     * Counts at and above which a reading is saturated, above those of the white. INFINITY if there are none.
     */
    float saturation;
    /**
     * One of glimpse_footprint.
     */
    int32_t footprint;
    /**
     * Directions at which the white was read. Unused with GLIMPSE_FOOTPRINT_ANY.
     */
    struct glimpse_directions reference;
} glimpse_calibration;

/**
 * Mean and variance of repeated readings. All fields of a new one are 0; glimpse_repeated_add() adds to it.
 */
typedef struct glimpse_repeated {
    /**
     * Number of readings.
     */
    uint32_t count;
    /**
     * Not 0 if a reading was saturated: the mean is then too low.
     */
    uint8_t saturated;
    /**
     * The mean.
     */
    float mean[3];
    /**
     * Sums of squared distances from the mean.
     */
    float squares[3];
    /**
     * The unbiased variance of a reading; NAN after the first reading. The variance of the mean is this
     * divided by count.
     */
    float variance[3];
} glimpse_repeated;

/**
 * Options of a driver. glimpse_config_default() returns the defaults.
 */
typedef struct glimpse_config {
    /**
     * One of glimpse_host.
     */
    int32_t host;
    /**
     * Not 0 if `machine` is set. The driver skips samples out of reach if the recipe tolerates missing
     * readings; else the scan fails before any move. If 0, the driver assumes that all samples are within
     * reach.
     */
    uint8_t has_machine;
    /**
     * Number of invalid readings of a sample after which the driver skips it, or fails if the recipe needs
     * every reading. 0 means 1.
     */
    uint8_t attempts;
    /**
     * The measuring machine: its reach, and the axes that it lacks.
     */
    struct glimpse_machine machine;
    /**
     * Seed of the sequence numbers on the link. It must differ from the seeds of all earlier drivers of this
     * device: the result of glimpse_store_count_boot(), a random number, or the value of a free-running timer.
     */
    uint32_t sequence_seed;
    /**
     * Units of the fit per glimpse_driver_poll(). 0 means 1.
     */
    uint32_t steps_per_poll;
    /**
     * Interval of retransmissions of a request without a reply, in ms.
     */
    uint32_t retransmit_interval_ms;
    /**
     * Timeout of a reply, in ms. After it, the scan fails with a host that measures, and continues alone with
     * one that listens. A greeting to a host that measures has no timeout.
     */
    uint32_t reply_timeout_ms;
    /**
     * Timeout of a reading by the host, in ms; includes the motion of its arms.
     */
    uint32_t measure_timeout_ms;
    /**
     * The largest glimpse_residual.dark of a plausible result. 0: not limited, and the lamp is never switched
     * off.
     */
    float max_dark;
    /**
     * The largest glimpse_residual.drift of a plausible result. 0: not limited, and no sample is read again.
     */
    float max_drift;
    /**
     * The largest share of saturated readings of a plausible result. 0: not limited.
     */
    float max_saturated;
    /**
     * Loss at which a scan stops before all samples are read; 0 for none. After each reading, the driver
     * fits the readings that it has. If glimpse_fitted.loss_bound is at most this loss, it skips the
     * pending samples, and this fit is the result. Each fit takes as many units as one of all readings. The
     * bound holds only for the first samples in the recipe's order, so the driver reads all samples if one was
     * skipped, out of reach, saturated, or read out of order. It has no effect with recipes that do not bound
     * the loss of such fits.
     */
    float target_loss;
} glimpse_config;

/**
 * The next action of the firmware. Fields that its kind does not use are 0.
 */
typedef struct glimpse_action {
    /**
     * The kind.
     */
    glimpse_action_kind kind;
    /**
     * Reason of a failure.
     */
    glimpse_status failure;
    /**
     * Purpose of a reading: one of glimpse_purpose.
     */
    int32_t purpose;
    /**
     * Directions of light and sensor.
     */
    struct glimpse_directions directions;
    /**
     * The reading to save.
     */
    struct glimpse_reading reading;
    /**
     * Quality of the fit.
     */
    struct glimpse_residual residual;
    /**
     * Index of a sample.
     */
    uint16_t index;
    /**
     * 0 if the sample was skipped: save the skip.
     */
    uint8_t has_reading;
} glimpse_action;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Returns the text of a status: an English sentence, zero-terminated, constant and never null. A number
 * that is not a status has a text, too.
 */
const char *glimpse_status_text(int32_t status);

/**
 * Returns the version of this library, such as "0.3.0": zero-terminated, constant and never null. It
 * should equal the header's GLIMPSE_VERSION.
 */
const char *glimpse_version(void);

/**
 * Checks a recipe and describes it.
 *
 * @param recipe  The recipe, as written by trainer, with any alignment, in flash or in RAM.
 * @param count   Number of bytes.
 * @param result  Receives the description.
 * @return GLIMPSE_STATUS_RECIPE_... if the bytes are not a valid recipe; GLIMPSE_STATUS_MODEL if the
 *         library was built for another model.
 */
glimpse_status glimpse_recipe_describe(const uint8_t *recipe,
                                       size_t count,
                                       struct glimpse_recipe *result);

/**
 * Returns the size of the memory that glimpse_scan_begin() needs with a recipe, in bytes. Returns 0 if this
 * library does not accept the recipe: glimpse_recipe_describe() returns the reason.
 *
 * @param recipe  The recipe, with any alignment.
 * @param count   Number of bytes.
 */
size_t glimpse_scan_bytes(const uint8_t *recipe,
                          size_t count);

/**
 * Begins a scan. The memory needs no initialization; its content is overwritten.
 *
 * @param memory        The caller's memory, aligned to GLIMPSE_ALIGNMENT, as declared by
 *                      GLIMPSE_MEMORY. No other code may read, write or move it until
 *                      glimpse_scan_end().
 * @param memory_bytes  Its size: at least glimpse_scan_bytes() of the recipe.
 * @param recipe        The recipe, with any alignment. It is not copied: it must not change while the
 *                      scan is in use. It must not lie in the scan's memory.
 * @param recipe_bytes  Number of bytes of the recipe.
 * @param scan          Receives the handle, a pointer into the memory; null after an error.
 * @return As glimpse_recipe_describe(), or GLIMPSE_STATUS_MEMORY.
 */
glimpse_status glimpse_scan_begin(void *memory,
                                  size_t memory_bytes,
                                  const uint8_t *recipe,
                                  size_t recipe_bytes,
                                  struct glimpse_scan **scan);

/**
 * Ends a scan. Its memory can be used for anything else. Further calls with the handle return
 * GLIMPSE_STATUS_STALE, as long as the memory is not overwritten with the same bytes.
 */
glimpse_status glimpse_scan_end(struct glimpse_scan *scan);

/**
 * Sets the basis that glimpse_fitted_brdf() needs for the model Linear. The whole basis is checked, which
 * takes some milliseconds per 100 kB on a Cortex-M4F at 168 MHz. A driver's scan cannot have a basis: a
 * host computes its BRDF from the values.
 *
 * @param scan   The scan.
 * @param basis  The output of trainer export --format basis, with any alignment. It is not copied: it
 *               must not change while the scan is in use.
 * @param count  Number of bytes.
 * @return GLIMPSE_STATUS_BASIS_... if the bytes are not a valid basis; GLIMPSE_STATUS_BASIS if the
 *         recipe names another basis.
 */
glimpse_status glimpse_scan_set_basis(struct glimpse_scan *scan,
                                      const uint8_t *basis,
                                      size_t count);

/**
 * Deletes all readings for the next material. Skipped samples are pending again.
 */
glimpse_status glimpse_scan_restart(struct glimpse_scan *scan);

/**
 * Returns the next pending sample in the recipe's order. Samples may be read in any order:
 * glimpse_machine_nearest() returns the one that the arms reach first.
 *
 * @param scan    The scan, or that of a driver.
 * @param from    The smallest index to return; 0 for the first pending sample.
 * @param sample  Receives the sample.
 * @return GLIMPSE_STATUS_NONE_PENDING if all samples from this index on are read or skipped.
 */
glimpse_status glimpse_scan_next(const struct glimpse_scan *scan,
                                 uint16_t from,
                                 struct glimpse_sample *sample);

/**
 * Records the reading of a sample, in any order. A second reading of the same sample replaces the first:
 * glimpse_repeated_add() averages readings instead. A fit that is under way, or its result, is dropped.
 *
 * @param scan      The scan.
 * @param index     Index of the sample in the pattern.
 * @param reading   The reading; it is copied.
 * @param recorded  Receives details, or null.
 * @return GLIMPSE_STATUS_READING_... if the reading is invalid: read the sample again.
 */
glimpse_status glimpse_scan_record(struct glimpse_scan *scan,
                                   uint16_t index,
                                   const struct glimpse_reading *reading,
                                   struct glimpse_recorded *recorded);

/**
 * Skips a sample that cannot be read: it is no longer pending, and its reading is deleted. A later
 * glimpse_scan_record() of the sample undoes this. A fit that is under way, or its result, is dropped.
 *
 * @param scan   The scan.
 * @param index  Index of the sample in the pattern.
 * @return GLIMPSE_STATUS_READING_REQUIRED if the recipe does not tolerate missing readings,
 *         GLIMPSE_STATUS_READING_INDEX if the index is too large.
 */
glimpse_status glimpse_scan_skip(struct glimpse_scan *scan,
                                 uint16_t index);

/**
 * Skips all pending samples, so that the fit uses only the recorded readings.
 *
 * @param scan  The scan.
 * @return GLIMPSE_STATUS_READING_REQUIRED if the recipe does not tolerate missing readings.
 */
glimpse_status glimpse_scan_finish_early(struct glimpse_scan *scan);

/**
 * Returns the recorded reading of a sample, unchanged by fits.
 *
 * @param scan     The scan, or that of a driver.
 * @param index    Index of the sample in the pattern.
 * @param reading  Receives the reading.
 * @return GLIMPSE_STATUS_NOT_READ if the sample has no reading, or does not exist.
 */
glimpse_status glimpse_scan_reading(const struct glimpse_scan *scan,
                                    uint16_t index,
                                    struct glimpse_reading *reading);

/**
 * Counts a boot, for glimpse_config.sequence_seed. Call it once after each reset. The scan may have begun in
 * the memory in which glimpse_driver_begin() then begins a driver with the same recipe.
 *
 * @param flash  The flash.
 * @param scan   The scan, or that of a driver.
 * @param boots  Receives the number of boots, including this one.
 * @return GLIMPSE_STATUS_STORAGE if a callback fails; GLIMPSE_STATUS_STORE_LAYOUT if the areas are too
 *         small, or start or length is not a multiple of 32.
 */
glimpse_status glimpse_store_count_boot(const struct glimpse_flash *flash,
                                        const struct glimpse_scan *scan,
                                        uint32_t *boots);

/**
 * Records the saved readings and skips in a scan. Call it after glimpse_scan_begin(); glimpse_driver_begin()
 * does it for a driver. An error while it reads leaves some of them in the scan.
 *
 * @param flash  The flash.
 * @param scan   The scan.
 * @param count  Receives the number of readings, or null.
 * @return As glimpse_store_count_boot().
 */
glimpse_status glimpse_store_restore(const struct glimpse_flash *flash,
                                     struct glimpse_scan *scan,
                                     uint16_t *count);

/**
 * Saves a reading. It replaces an earlier one of the same sample.
 *
 * @param flash    The flash.
 * @param scan     The scan, or that of a driver. Its own readings are not used.
 * @param index    Index of the sample in the pattern.
 * @param reading  The reading; null if the sample was skipped.
 * @return As glimpse_store_count_boot(), or GLIMPSE_STATUS_READING_... if the reading is invalid.
 */
glimpse_status glimpse_store_save(const struct glimpse_flash *flash,
                                  const struct glimpse_scan *scan,
                                  uint16_t index,
                                  const struct glimpse_reading *reading);

/**
 * Deletes all saved readings.
 *
 * @param flash  The flash.
 * @param scan   The scan, or that of a driver. Its own readings stay.
 * @return As glimpse_store_count_boot().
 */
glimpse_status glimpse_store_clear(const struct glimpse_flash *flash,
                                   const struct glimpse_scan *scan);

/**
 * Begins a fit of all readings. An earlier fit is dropped.
 *
 * If the recipe tolerates missing readings, the fit omits missing and saturated readings. If all readings
 * are saturated, it uses them. A fit may therefore begin after the first reading, and again after each
 * further one.
 *
 * @param scan  The scan.
 * @return GLIMPSE_STATUS_INCOMPLETE if a required reading or every reading is missing;
 *         GLIMPSE_STATUS_READINGS_TOO_LARGE if the readings are too large for a BRDF, such as counts.
 */
glimpse_status glimpse_fit_begin(struct glimpse_scan *scan);

/**
 * Advances the fit. The result does not depend on the budgets.
 *
 * @param scan      The scan.
 * @param budget    The maximum number of units of work. 8 units take some milliseconds on a Cortex-M4F at
 *                  168 MHz with the slowest model. UINT32_MAX completes the fit.
 * @param progress  Receives the progress, or null.
 * @return GLIMPSE_STATUS_NO_FIT if no fit is under way.
 */
glimpse_status glimpse_fit_advance(struct glimpse_scan *scan,
                                   uint32_t budget,
                                   struct glimpse_progress *progress);

/**
 * Finishes a complete fit. Checks that all values, and the fitted material at every reading, are finite and
 * plausible.
 *
 * After GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_RESTORED (84 to 95) the fit has a result, but it
 * is unlikely to describe a material: check the sensor. The glimpse_fitted_...() functions return the result
 * nevertheless.
 *
 * @param scan  The scan.
 * @return GLIMPSE_STATUS_NO_FIT if no fit is under way; GLIMPSE_STATUS_UNFINISHED if it is not
 *         complete; GLIMPSE_STATUS_DIVERGED if a number is not finite: the readings stay, and the fit
 *         ends; GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_RESTORED if the result is
 *         implausible.
 */
glimpse_status glimpse_fit_finish(struct glimpse_scan *scan);

/**
 * Describes the fitted material: its residual, and the expected error of its BRDF.
 *
 * @param scan    The scan, or that of a driver.
 * @param fitted  Receives the description.
 * @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading.
 */
glimpse_status glimpse_fitted_describe(const struct glimpse_scan *scan,
                                       struct glimpse_fitted *fitted);

/**
 * Returns the fitted material's BRDF.
 *
 * @param scan        The scan, or that of a driver.
 * @param directions  Two unit directions above the horizon.
 * @param brdf        Receives linear red, green and blue, in sr^-1, not times the cosine.
 * @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading;
 *         GLIMPSE_STATUS_DIRECTIONS if a direction is invalid; GLIMPSE_STATUS_NO_BASIS if the model is
 *         Linear and the scan has no basis: call glimpse_scan_set_basis(), or compute the BRDF on a host
 *         from the values; GLIMPSE_STATUS_DIVERGED if the BRDF is too large for a float.
 */
glimpse_status glimpse_fitted_brdf(const struct glimpse_scan *scan,
                                   const struct glimpse_directions *directions,
                                   float (*brdf)[3]);

/**
 * Returns the fitted values, all finite: the model's parameters in its order, or Linear's coefficients,
 * m for red, m for green, m for blue. A host renders them.
 *
 * @param scan      The scan, or that of a driver.
 * @param values    Receives the values; may be null if capacity is 0.
 * @param capacity  The largest number of values to write.
 * @param count     Receives the number of values, also with GLIMPSE_STATUS_BUFFER_TOO_SMALL.
 * @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading;
 *         GLIMPSE_STATUS_BUFFER_TOO_SMALL if capacity is too small.
 */
glimpse_status glimpse_fitted_values(const struct glimpse_scan *scan,
                                     float *values,
                                     size_t capacity,
                                     size_t *count);

/**
 * Returns the directions of two arms. All angles are valid; below the horizon the BRDF is undefined.
 */
struct glimpse_directions glimpse_directions_of(struct glimpse_arms arms);

/**
 * Returns a machine without limits, whose four axes move at 1 rad/s, for isotropic samples. Its arms do not
 * swing through the normal.
 */
struct glimpse_machine glimpse_machine_default(void);

/**
 * Checks that a machine reaches a pair of directions, within its limits and with its axes.
 *
 * @param machine     The machine.
 * @param directions  The directions.
 * @return GLIMPSE_STATUS_MAX_THETA_I to GLIMPSE_STATUS_MISSING_AXIS if they are out of reach;
 *         GLIMPSE_STATUS_DIRECTIONS if they have no BRDF; GLIMPSE_STATUS_ARGUMENT_MACHINE if the limits are
 *         invalid.
 */
glimpse_status glimpse_machine_check(const struct glimpse_machine *machine,
                                     const struct glimpse_directions *directions);

/**
 * Returns the pending sample of a scan that the arms reach first. Samples out of reach are ignored. A recipe
 * in path order takes less time in its own order: use glimpse_scan_next() instead.
 *
 * @param machine  The machine.
 * @param scan     The scan, or that of a driver.
 * @param from     The position of the arms. Use the result of the previous call, so that azimuths are
 *                 continuous.
 * @param move     Receives the sample, the new position of the arms, and the duration.
 * @return GLIMPSE_STATUS_NONE_PENDING if all samples are read or skipped; GLIMPSE_STATUS_OUT_OF_REACH if
 *         all pending samples are out of reach; GLIMPSE_STATUS_ARGUMENT_MACHINE if the limits are invalid.
 */
glimpse_status glimpse_machine_nearest(const struct glimpse_machine *machine,
                                       const struct glimpse_scan *scan,
                                       const struct glimpse_arms *from,
                                       struct glimpse_move *move);

/**
 * Converts counts of the sensor to a reading.
 *
 * @param calibration  Counts of dark and white, and the white's reflectance.
 * @param counts       The three counts of the sample: red, green and blue. A monochrome sensor repeats its
 *                     count.
 * @param at           Directions of the sample. Unused with GLIMPSE_FOOTPRINT_ANY, and may then be null.
 * @param reading      Receives the reading.
 * @return GLIMPSE_STATUS_CHANNEL_NON_FINITE if counts or their BRDF are not finite;
 *         GLIMPSE_STATUS_WHITE_... if the white is invalid; GLIMPSE_STATUS_DIRECTIONS if an arm is at or
 *         below the horizon; GLIMPSE_STATUS_ARGUMENT_CALIBRATION if the footprint is unknown.
 */
glimpse_status glimpse_calibrate(const struct glimpse_calibration *calibration,
                                 const float *counts,
                                 const struct glimpse_directions *at,
                                 struct glimpse_reading *reading);

/**
 * Adds a reading to the mean and variance of repeated readings. They may be counts or BRDFs. Conversion by
 * glimpse_calibrate() is linear, so the BRDF of the mean counts is the mean of the BRDFs.
 *
 * @param repeated   The mean. All fields of a new one are 0.
 * @param reading    The counts or the BRDF of the three channels.
 * @param saturated  Not 0 if the sensor was saturated.
 * @return GLIMPSE_STATUS_CHANNEL_NON_FINITE if a channel is not finite, or too large for the sums. Nothing
 *         has changed then.
 */
glimpse_status glimpse_repeated_add(struct glimpse_repeated *repeated,
                                    const float *reading,
                                    uint8_t saturated);

/**
 * Returns the size of the memory that glimpse_driver_begin() needs with a recipe, in bytes. Returns 0 if
 * this library does not accept the recipe: glimpse_recipe_describe() returns the reason.
 *
 * @param recipe  The recipe, with any alignment.
 * @param count   Number of bytes.
 */
size_t glimpse_driver_bytes(const uint8_t *recipe,
                            size_t count);

/**
 * Returns the default options: no machine, seed 0, 8 steps per poll, retransmissions after 0.1 s, a timeout
 * of 2 s for replies and of 60 s for readings, three attempts, no target loss, and limits of 5 % of light
 * with the lamp off, of 5 % of drift, and of a fifth of saturated readings. If the lamp cannot be switched,
 * set `max_dark` to 0. The field `machine` is that of glimpse_machine_default(), without effect until
 * `has_machine` is set.
 *
 * @param host  One of glimpse_host.
 */
struct glimpse_config glimpse_config_default(int32_t host);

/**
 * Begins a driver. Memory and recipe are as for glimpse_scan_begin().
 *
 * @param memory        The caller's memory, aligned to GLIMPSE_ALIGNMENT.
 * @param memory_bytes  Its size: glimpse_driver_bytes() of the recipe.
 * @param recipe        The recipe, which must not change while the driver is in use.
 * @param recipe_bytes  Number of bytes of the recipe.
 * @param config        The options; they are copied.
 * @param flash         The flash with saved readings of an interrupted scan, or null. They are restored as by
 *                      glimpse_store_restore(). A host that measures confirms that they are still valid.
 *                      With other hosts, pass it only if the material is the same. It is not used after
 *                      this call.
 * @param driver        Receives the handle, a pointer into the memory; null after an error. An error of the
 *                      flash may end the use of an earlier handle in the memory.
 * @return As glimpse_scan_begin() and glimpse_store_restore(); GLIMPSE_STATUS_ARGUMENT_HOST,
 *         GLIMPSE_STATUS_ARGUMENT_MACHINE or GLIMPSE_STATUS_ARGUMENT_TARGET_LOSS if an option is invalid.
 */
glimpse_status glimpse_driver_begin(void *memory,
                                    size_t memory_bytes,
                                    const uint8_t *recipe,
                                    size_t recipe_bytes,
                                    const struct glimpse_config *config,
                                    const struct glimpse_flash *flash,
                                    struct glimpse_driver **driver);

/**
 * Ends a driver. Its memory can be used for anything else. Further calls with the handle return
 * GLIMPSE_STATUS_STALE, as long as the memory is not overwritten with the same bytes.
 */
glimpse_status glimpse_driver_end(struct glimpse_driver *driver);

/**
 * Advances the driver and returns the firmware's next action. Call it repeatedly; a call takes at most the
 * time of steps_per_poll units of the fit.
 *
 * @param driver  The driver.
 * @param now_ms  The time of a monotonic clock with any origin, in ms. After UINT32_MAX it continues with 0,
 *                as that of HAL_GetTick() does after 49.7 days.
 * @param action  Receives the action.
 */
glimpse_status glimpse_driver_poll(struct glimpse_driver *driver,
                                   uint32_t now_ms,
                                   struct glimpse_action *action);

/**
 * Returns the time until the next necessary poll.
 *
 * @param driver    The driver.
 * @param now_ms    The time, as for glimpse_driver_poll(), at or after the last poll.
 * @param delay_ms  Receives the time in ms. UINT32_MAX if there is none: then only a received byte, a
 *                  sent byte or another call changes the driver's state.
 */
glimpse_status glimpse_driver_poll_delay(const struct glimpse_driver *driver,
                                         uint32_t now_ms,
                                         uint32_t *delay_ms);

/**
 * Takes bytes that were received from the serial line.
 *
 * @param driver  The driver.
 * @param bytes   The bytes; may be null if count is 0.
 * @param count   Number of bytes.
 */
glimpse_status glimpse_driver_receive(struct glimpse_driver *driver,
                                      const uint8_t *bytes,
                                      size_t count);

/**
 * Returns the bytes to send. Send as many as possible, then call glimpse_driver_sent(). Until then the
 * bytes are valid only if no other function changes this driver.
 *
 * @param driver  The driver.
 * @param bytes   Receives a pointer to the bytes in the driver's memory; do not write to them.
 * @param count   Receives their number, which may be 0.
 */
glimpse_status glimpse_driver_outgoing(const struct glimpse_driver *driver,
                                       const uint8_t **bytes,
                                       size_t *count);

/**
 * Marks the first outgoing bytes as sent.
 *
 * @param driver  The driver.
 * @param count   Number of bytes. If it exceeds the number of outgoing bytes, all are marked.
 */
glimpse_status glimpse_driver_sent(struct glimpse_driver *driver, size_t count);

/**
 * Records a reading of the device's own sensor. Samples may come in any order. If the driver has requested a
 * reading for another purpose than GLIMPSE_PURPOSE_SAMPLE, a reading with its index is that one. After
 * glimpse_config.attempts invalid readings of a sample, the driver skips it if the recipe tolerates missing
 * readings. Otherwise the scan fails.
 *
 * @param driver   The driver.
 * @param index    Index of the sample in the pattern.
 * @param reading  The reading; it is copied.
 * @return GLIMPSE_STATUS_READING_... if the reading is invalid: the driver requests it again, so the
 *         firmware may ignore this status; GLIMPSE_STATUS_NOT_SCANNING if the scan is finished or has
 *         failed.
 */
glimpse_status glimpse_driver_record(struct glimpse_driver *driver,
                                     uint16_t index,
                                     const struct glimpse_reading *reading);

/**
 * Skips a sample that cannot be read. A later glimpse_driver_record() of the sample undoes this. If the
 * driver has requested a reading for another purpose with this index, it goes on without that one.
 *
 * @param driver  The driver.
 * @param index   Index of the sample in the pattern.
 * @return As glimpse_scan_skip(), or GLIMPSE_STATUS_NOT_SCANNING as glimpse_driver_record().
 */
glimpse_status glimpse_driver_skip(struct glimpse_driver *driver,
                                   uint16_t index);

/**
 * Skips all pending samples, so that the fit uses only the recorded readings.
 *
 * @param driver  The driver.
 * @return As glimpse_scan_finish_early(), or GLIMPSE_STATUS_NOT_SCANNING as glimpse_driver_record().
 */
glimpse_status glimpse_driver_finish_early(struct glimpse_driver *driver);

/**
 * Stops the scan because of a failure, and keeps its readings. The driver reports the failure to the host.
 * It requests no further move until glimpse_driver_resume() or glimpse_driver_restart().
 *
 * @param driver   The driver.
 * @param failure  The failure of the device's own arms, sensor or lamp, or its operator's stop:
 *                 GLIMPSE_STATUS_MACHINE, or GLIMPSE_STATUS_STOPPED to GLIMPSE_STATUS_NOT_CALIBRATED (128 to
 *                 148); GLIMPSE_STATUS_STORAGE if its flash failed.
 * @param first    The first detail of this failure in the table of core/src/error.rs, which the host
 *                 displays; 0 if it has none. Axes have the numbers 0 to 3, in the order of glimpse_arms.
 * @param second   The second detail.
 * @return GLIMPSE_STATUS_ARGUMENT_FAILURE for another failure: then nothing changes.
 */
glimpse_status glimpse_driver_fail(struct glimpse_driver *driver,
                                   int32_t failure,
                                   uint32_t first,
                                   uint32_t second);

/**
 * Continues a scan that has failed, with the readings that it has. With a host, the driver greets it after
 * a pause of 0.5 s, which doubles with each failure, up to 30 s. A success, such as a valid reading, ends
 * the pauses. Without a failure, the call has no effect.
 */
glimpse_status glimpse_driver_resume(struct glimpse_driver *driver);

/**
 * Begins a scan of the next material. If readings were saved, the next poll returns
 * GLIMPSE_ACTION_KIND_FORGET.
 */
glimpse_status glimpse_driver_restart(struct glimpse_driver *driver);

/**
 * Returns the driver's scan, for functions that take a const glimpse_scan. It shows the present state of the
 * driver at any time. Functions that change a scan refuse it with GLIMPSE_STATUS_READ_ONLY.
 *
 * @param driver  The driver.
 * @param scan    Receives the scan; null after an error.
 */
glimpse_status glimpse_driver_scan(const struct glimpse_driver *driver,
                                   const struct glimpse_scan **scan);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* GLIMPSE_H */
