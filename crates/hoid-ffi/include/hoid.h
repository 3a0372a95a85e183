/* hoid: estimates of a person who controls a machine, sample by sample.
 *
 * Every function that can fail answers with a hoid_status: 0 for done, positive where there is no
 * value now, negative for an error; hoid_last_error returns the reason for the last such status in the same thread.
 * One thread at a time may use a tracker; trackers are independent of each other.
 *
 * Made by cargo xtask ffi --header from crates/hoid-ffi; not to be edited. */

#ifndef HOID_H
#define HOID_H

#include <stddef.h>
#include <stdint.h>

/*
 Version of this interface. Within a version, functions and constants may be added but are never changed.
 */
#define HOID_ABI_VERSION 1

/*
 No check found a problem with the estimate.
 */
#define HOID_TRUSTWORTHY 0

/*
 A check found a problem with the estimate.
 */
#define HOID_DOUBTFUL 1

/*
 The data do not determine the estimate, or there is no estimate.
 */
#define HOID_NOT_DETERMINED 2

/*
 Number of quantities in a change.
 */
#define HOID_SHIFTS 6

/*
 Handle of a tracker. Create it with hoid_tracker_new, hoid_tracker_from_fit or hoid_tracker_restore, and free it
 with hoid_tracker_free. Only one thread at a time may use a tracker.
 */
typedef struct hoid_tracker hoid_tracker;

/*
 Return code of a function: zero for success, positive if there is no value, negative for an error.
 */
typedef int32_t hoid_status;

/*
 Estimate with its standard error.
 */
typedef struct {
  /*
   Name of the quantity; the pointer is valid as long as the tracker.
   */
  const char *name;
  /*
   Unit of the quantity, empty if there is none; the pointer is always valid.
   */
  const char *unit;
  /*
   Estimated value.
   */
  double value;
  /*
   Standard error of the value; NaN if there is none.
   */
  double standard_error;
  /*
   1 if the data determine the quantity, 0 if they do not, -1 if this is not assessed.
   */
  int32_t determined;
} hoid_estimate;

/*
 Quantity before and after a change.
 */
typedef struct {
  /*
   Name of the quantity; the pointer is always valid.
   */
  const char *name;
  /*
   Value before the change.
   */
  double before;
  /*
   Standard error of the value before the change; NaN if there is none.
   */
  double before_standard_error;
  /*
   Value after the change.
   */
  double after;
  /*
   Standard error of the value after the change; NaN if there is none.
   */
  double after_standard_error;
  /*
   Change divided by its standard error; for the remnant, the change in the logarithm divided by its standard
   error.
   */
  double z;
} hoid_shift;

/*
 Declared change in the person.
 */
typedef struct {
  /*
   Time in s from the change to its declaration.
   */
  double seconds_ago;
  /*
   With the method `adaptive`, -ln of the p-value of the change test; with `multiple-model`, log odds of a change
   within the last four seconds.
   */
  double log_odds;
  /*
   1/(1 + exp(-log_odds)); with `multiple-model`, the probability of the change.
   */
  double probability;
  /*
   K_e, K_e_dot (s), omega_nm (rad/s), zeta_nm, remnant (innovation variance) and tau_e (s), in this order.
   */
  hoid_shift shifts[HOID_SHIFTS];
} hoid_change;

/*
 Counts since the start.
 */
typedef struct {
  /*
   Number of samples.
   */
  uint64_t samples;
  /*
   Number of samples with a fault in e or u.
   */
  uint64_t skipped;
  /*
   Number of samples that the guard held back.
   */
  uint64_t held;
  /*
   Number of restarts of the estimate by the guard.
   */
  uint64_t restarts;
  /*
   Number of steps that were shortened to ensure stability or to respect a bound.
   */
  uint64_t steps_shortened;
} hoid_counts;

/*
 Outcome of an update with one sample.
 */
typedef struct {
  /*
   A-priori innovation; NaN if the sample was skipped or held back, and during the warm-up.
   */
  double innovation;
  /*
   1 after the warm-up, and always for a method without a warm-up; otherwise 0.
   */
  int32_t ready;
  /*
   1 if e or u was faulty: not finite, or larger in magnitude than `largest`.
   */
  int32_t skipped;
  /*
   1 if the guard held back the sample.
   */
  int32_t held;
  /*
   1 if the step of the estimate was shortened to ensure stability or to respect a bound.
   */
  int32_t shortened;
  /*
   1 if a change in the person was declared at this sample.
   */
  int32_t changed;
} hoid_outcome;

/*
 Success.
 */
#define HOID_OK 0

/*
 The requested value is currently not available; hoid_last_error returns the reason.
 */
#define HOID_NOTHING 1

/*
 A pointer is null or not aligned.
 */
#define HOID_BAD_POINTER -1

/*
 A string is not valid UTF-8.
 */
#define HOID_BAD_TEXT -2

/*
 The method, an option, the sample time or the fit cannot be used.
 */
#define HOID_BAD_OPTION -3

/*
 An array or buffer is too small.
 */
#define HOID_TOO_SMALL -4

/*
 The bytes are not a tracker saved by this version, or were changed.
 */
#define HOID_BAD_STATE -5

/*
 An internal error of hoid was caught.
 */
#define HOID_PANIC -6

/*
 An earlier call with this tracker failed with an internal error; free the tracker.
 */
#define HOID_BROKEN -7

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Returns the interface version of the loaded library; compare it with HOID_ABI_VERSION of the header.
 */
uint32_t hoid_abi_version(void);

/*
 Returns the version of hoid as a string, such as "0.1.0". The string is valid while the library is loaded.
 */
const char *hoid_version(void);

/*
 Creates a tracker and writes its handle to `tracker`. `method` is the name of the method (NULL: "adaptive", whose
 first estimate is available after one second), `sample_time` is in s, and `options` is a JSON object with the
 keywords of pyhoid.Tracker (NULL: none), such as "{\"controlled_element\": \"90/(s(s+6))\", \"prior\":
 \"fit.json\"}".

 # Safety
 `method` and `options` are NULL or null-terminated strings; `tracker` points to memory for a pointer.
 */
hoid_status hoid_tracker_new(const char *method,
                             double sample_time,
                             const char *options,
                             hoid_tracker **tracker);

/*
 Creates a tracker that starts from an earlier fit of the person, and writes its handle to `tracker`. `fit` is the
 JSON text printed by hoid identify --json. `sample_time` (in s) and `options` are as in hoid_tracker_new.

 # Safety
 `fit` is NULL or a null-terminated string; otherwise as for hoid_tracker_new.
 */
hoid_status hoid_tracker_from_fit(const char *fit,
                                  double sample_time,
                                  const char *options,
                                  hoid_tracker **tracker);

/*
 Frees a tracker. Does nothing if `tracker` is NULL.

 # Safety
 `tracker` is NULL or a tracker of this library that has not been freed.
 */
void hoid_tracker_free(hoid_tracker *tracker);

/*
 Saves the state of a tracker as bytes, so that another process can continue with bit-identical results. Writes the
 number of bytes to `length`, and the bytes to `buffer`, which has room for `room` bytes. With `buffer` NULL and
 `room` 0, only the number of bytes is written.

 # Safety
 `tracker` is a tracker of this library; `buffer` points to memory for `room` bytes, and `length` to memory for a
 number.
 */
hoid_status hoid_tracker_save(hoid_tracker *tracker,
                              uint8_t *buffer,
                              size_t room,
                              size_t *length);

/*
 Creates a tracker from the `length` bytes that hoid_tracker_save wrote to a buffer, and writes its handle to
 `tracker`.

 # Safety
 `buffer` points to `length` bytes; `tracker` points to memory for a pointer.
 */
hoid_status hoid_tracker_restore(const uint8_t *buffer,
                                 size_t length,
                                 hoid_tracker **tracker);

/*
 Returns HOID_OK after the warm-up, and always for a method without a warm-up. Returns HOID_NOTHING during the
 warm-up; hoid_last_error then reports the progress.

 # Safety
 `tracker` is a tracker of this library.
 */
hoid_status hoid_tracker_ready(const hoid_tracker *tracker);

/*
 Writes the parameters of the operator (K_e, T_L, K_e_dot, omega_nm, zeta_nm, tau_e) with their standard errors to
 `estimates`, which has room for `room` elements, and their number to `count`. With `estimates` NULL and `room` 0,
 only the number is written; if `room` is too small, the function returns HOID_TOO_SMALL.

 # Safety
 `tracker` is a tracker of this library; `estimates` points to memory for `room` elements, and `count` to memory for
 a number.
 */
hoid_status hoid_tracker_operator(const hoid_tracker *tracker,
                                  hoid_estimate *estimates,
                                  size_t room,
                                  size_t *count);

/*
 Writes the coefficients of the polynomials, in the order of theta, with their standard errors. The array is used as
 in hoid_tracker_operator.

 # Safety
 As for hoid_tracker_operator.
 */
hoid_status hoid_tracker_parameters(const hoid_tracker *tracker,
                                    hoid_estimate *estimates,
                                    size_t room,
                                    size_t *count);

/*
 Writes the covariance matrix of the coefficients, row by row. The array is used as in hoid_tracker_operator.

 # Safety
 As for hoid_tracker_operator.
 */
hoid_status hoid_tracker_covariance(const hoid_tracker *tracker,
                                    double *covariance,
                                    size_t room,
                                    size_t *count);

/*
 Writes the crossover frequency (crossover_rad_s) and the phase margin (phase_margin_deg) of the open loop with the
 controlled element given in the options. The array is used as in hoid_tracker_operator.

 # Safety
 As for hoid_tracker_operator.
 */
hoid_status hoid_tracker_open_loop(const hoid_tracker *tracker,
                                   hoid_estimate *estimates,
                                   size_t room,
                                   size_t *count);

/*
 Writes the gain (gain_db) and the phase (phase_deg) of the operator at the frequency `omega` in rad/s. The array is
 used as in hoid_tracker_operator.

 # Safety
 As for hoid_tracker_operator.
 */
hoid_status hoid_tracker_response(const hoid_tracker *tracker,
                                  double omega,
                                  hoid_estimate *estimates,
                                  size_t room,
                                  size_t *count);

/*
 Writes the change that was declared at the last sample; returns HOID_NOTHING if none was declared.

 # Safety
 `tracker` is a tracker of this library; `change` points to memory for a hoid_change.
 */
hoid_status hoid_tracker_change(const hoid_tracker *tracker, hoid_change *change);

/*
 Writes the current evidence of a change, defined as log_odds of hoid_change. Before the first estimate it is 0
 (`adaptive`) or -inf (`multiple-model`). Returns HOID_NOTHING for a method that does not report changes.

 # Safety
 `tracker` is a tracker of this library; `log_odds` points to memory for a number.
 */
hoid_status hoid_tracker_change_log_odds(const hoid_tracker *tracker,
                                         double *log_odds);

/*
 Writes the verdict on the current estimate: HOID_TRUSTWORTHY, HOID_DOUBTFUL or HOID_NOT_DETERMINED.

 # Safety
 `tracker` is a tracker of this library; `level` points to memory for a number.
 */
hoid_status hoid_tracker_level(const hoid_tracker *tracker, int32_t *level);

/*
 Returns the name of a verdict level, such as "trustworthy"; an empty string for any other number. The string is
 valid while the library is loaded.
 */
const char *hoid_level_name(int32_t level);

/*
 Writes the numbers of samples and events since the start.

 # Safety
 `tracker` is a tracker of this library; `counts` points to memory for a hoid_counts.
 */
hoid_status hoid_tracker_counts(const hoid_tracker *tracker, hoid_counts *counts);

/*
 Writes the sample time in s.

 # Safety
 `tracker` is a tracker of this library; `sample_time` points to memory for a number.
 */
hoid_status hoid_tracker_sample_time(const hoid_tracker *tracker, double *sample_time);

/*
 Returns the message of the last status in this thread that was not HOID_OK, or an empty string if there was none.
 The pointer stays valid until a function called in this thread again returns a status other than HOID_OK.
 */
const char *hoid_last_error(void);

/*
 Updates the tracker with one sample: error `e` and control `u`, where NaN marks a missing value. `outcome` may be
 NULL.

 # Safety
 `tracker` is a tracker of this library; `outcome` is NULL or points to memory for a hoid_outcome.
 */
hoid_status hoid_tracker_step(hoid_tracker *tracker,
                              double e,
                              double u,
                              hoid_outcome *outcome);

/*
 As hoid_tracker_step, with the external signal `f_t` (NaN if it is unknown). With `moves` 0 the filters are updated,
 but not the estimate.

 # Safety
 As for hoid_tracker_step.
 */
hoid_status hoid_tracker_update(hoid_tracker *tracker,
                                double e,
                                double u,
                                double f_t,
                                int32_t moves,
                                hoid_outcome *outcome);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HOID_H */
