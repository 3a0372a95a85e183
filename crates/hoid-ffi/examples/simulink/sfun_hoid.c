/* An S-function of level 2 for Simulink: e and u in, the estimate of the person out.
 *
 *     mex sfun_hoid.c -I/where/sdk/include -L/where/sdk/lib -lhoid
 *
 * Parameters of the block: method ('adaptive'), sample time in s (0.01), options in JSON ('').
 * Input port: [e u]. Output port, NaN for what is not known:
 *
 *     1..12   K_e, T_L, K_e_dot, omega_nm, zeta_nm, tau_e, a standard error behind each
 *     13..16  crossover in rad/s, phase margin in deg, a standard error behind each
 *     17      innovation
 *     18      1 where a change of the person was declared at this sample
 *     19      0 trustworthy, 1 doubtful, 2 not determined
 */
#define S_FUNCTION_NAME sfun_hoid
#define S_FUNCTION_LEVEL 2

#include "simstruc.h"

#include <hoid.h>
#include <math.h>

enum { METHOD, SAMPLE_TIME, OPTIONS, PARAMETERS };
enum { OUTPUTS = 19 };

static void mdlInitializeSizes(SimStruct *S) {
    ssSetNumSFcnParams(S, PARAMETERS);
    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) return;
    for (int i = 0; i < PARAMETERS; i++) ssSetSFcnParamTunable(S, i, 0);
    if (!ssSetNumInputPorts(S, 1)) return;
    ssSetInputPortWidth(S, 0, 2);
    ssSetInputPortRequiredContiguous(S, 0, 1);
    ssSetInputPortDirectFeedThrough(S, 0, 1);
    if (!ssSetNumOutputPorts(S, 1)) return;
    ssSetOutputPortWidth(S, 0, OUTPUTS);
    ssSetNumSampleTimes(S, 1);
    ssSetNumPWork(S, 1);
    ssSetOptions(S, SS_OPTION_EXCEPTION_FREE_CODE);
}

static void mdlInitializeSampleTimes(SimStruct *S) {
    ssSetSampleTime(S, 0, mxGetScalar(ssGetSFcnParam(S, SAMPLE_TIME)));
    ssSetOffsetTime(S, 0, 0.0);
}

/* False, and the simulation is told, where a function failed or there is no value. */
static int is_there(SimStruct *S, hoid_status status) {
    if (status < 0) ssSetErrorStatus(S, hoid_last_error());
    return status == HOID_OK;
}

#define MDL_START
static void mdlStart(SimStruct *S) {
    static char method[64], options[4096];
    hoid_tracker *tracker = NULL;
    if (hoid_abi_version() != HOID_ABI_VERSION) {
        ssSetErrorStatus(S, "the library hoid has another interface than hoid.h");
        return;
    }
    if (mxGetString(ssGetSFcnParam(S, METHOD), method, sizeof method) != 0 ||
        mxGetString(ssGetSFcnParam(S, OPTIONS), options, sizeof options) != 0) {
        ssSetErrorStatus(S, "method and options are texts, of at most 63 and 4095 characters");
        return;
    }
    double sample_time = mxGetScalar(ssGetSFcnParam(S, SAMPLE_TIME));
    if (is_there(S, hoid_tracker_new(method, sample_time, options, &tracker))) ssSetPWorkValue(S, 0, tracker);
}

static void put(real_T *to, const hoid_estimate *estimates, size_t expected, size_t count) {
    for (size_t i = 0; i < expected; i++) {
        to[2 * i] = i < count ? estimates[i].value : NAN;
        to[2 * i + 1] = i < count ? estimates[i].standard_error : NAN;
    }
}

static void mdlOutputs(SimStruct *S, int_T tid) {
    hoid_tracker *tracker = ssGetPWorkValue(S, 0);
    const real_T *in = ssGetInputPortRealSignal(S, 0);
    real_T *out = ssGetOutputPortRealSignal(S, 0);
    hoid_outcome outcome;
    hoid_estimate estimates[6];
    size_t count = 0;
    int32_t level = HOID_NOT_DETERMINED;
    (void)tid;
    if (!is_there(S, hoid_tracker_step(tracker, in[0], in[1], &outcome))) return;
    if (!is_there(S, hoid_tracker_operator(tracker, estimates, 6, &count))) count = 0;
    put(out, estimates, 6, count);
    if (!is_there(S, hoid_tracker_open_loop(tracker, estimates, 6, &count))) count = 0;
    put(out + 12, estimates, 2, count);
    is_there(S, hoid_tracker_level(tracker, &level));
    out[16] = outcome.innovation;
    out[17] = outcome.changed;
    out[18] = level;
}

static void mdlTerminate(SimStruct *S) {
    hoid_tracker_free(ssGetPWorkValue(S, 0));
    ssSetPWorkValue(S, 0, NULL);
}

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
