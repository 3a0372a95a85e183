/* Substitute for the part of Simulink's header that the example uses, written from its documentation: the test
 * compiles the S-function with it, and runs it as Simulink would. It is not Simulink. */
#ifndef SIMSTRUC_H
#define SIMSTRUC_H

#include <stddef.h>
#include <string.h>

typedef double real_T;
typedef int int_T;

typedef struct {
    const char *text;
    double number;
} mxArray;

typedef struct {
    int expected_parameters, ports_in, ports_out, width_in, width_out, sample_times, pointers;
    const mxArray *parameters[3];
    double sample_time, offset;
    void *work[1];
    double in[2], out[32];
    const char *error;
} SimStruct;

#define SS_OPTION_EXCEPTION_FREE_CODE 1

#define ssSetNumSFcnParams(S, n) ((S)->expected_parameters = (n))
#define ssGetNumSFcnParams(S) ((S)->expected_parameters)
#define ssGetSFcnParamsCount(S) 3
#define ssSetSFcnParamTunable(S, i, is) ((void)(i))
#define ssGetSFcnParam(S, i) ((S)->parameters[i])
#define ssSetNumInputPorts(S, n) ((S)->ports_in = (n))
#define ssSetInputPortWidth(S, port, n) ((S)->width_in = (n))
#define ssSetInputPortRequiredContiguous(S, port, is) ((void)0)
#define ssSetInputPortDirectFeedThrough(S, port, is) ((void)0)
#define ssSetNumOutputPorts(S, n) ((S)->ports_out = (n))
#define ssSetOutputPortWidth(S, port, n) ((S)->width_out = (n))
#define ssSetNumSampleTimes(S, n) ((S)->sample_times = (n))
#define ssSetNumPWork(S, n) ((S)->pointers = (n))
#define ssSetOptions(S, options) ((void)0)
#define ssSetSampleTime(S, i, s) ((S)->sample_time = (s))
#define ssSetOffsetTime(S, i, s) ((S)->offset = (s))
#define ssSetPWorkValue(S, i, pointer) ((S)->work[i] = (pointer))
#define ssGetPWorkValue(S, i) ((S)->work[i])
#define ssGetInputPortRealSignal(S, port) ((const real_T *)(S)->in)
#define ssGetOutputPortRealSignal(S, port) ((S)->out)
#define ssSetErrorStatus(S, text) ((S)->error = (text))

static double mxGetScalar(const mxArray *array) { return array->number; }

static int mxGetString(const mxArray *array, char *to, size_t room) {
    if (array->text == NULL || strlen(array->text) >= room) return 1;
    strcpy(to, array->text);
    return 0;
}

#endif
