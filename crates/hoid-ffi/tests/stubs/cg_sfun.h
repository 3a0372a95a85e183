/* Code that runs an S-function outside of MATLAB: here a program that passes it lines "e,u", as
 * Simulink would. Arguments: method, sample time, options. */
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv) {
    SimStruct simulation = {0};
    SimStruct *S = &simulation;
    if (argc != 4) return 2;
    mxArray parameters[3] = {{argv[1], 0.0}, {NULL, atof(argv[2])}, {argv[3], 0.0}};
    for (int i = 0; i < 3; i++) S->parameters[i] = &parameters[i];
    mdlInitializeSizes(S);
    if (S->ports_in != 1 || S->width_in != 2 || S->ports_out != 1 || S->width_out != 19 || S->pointers != 1) return 3;
    mdlInitializeSampleTimes(S);
    mdlStart(S);
    while (S->error == NULL && scanf("%lf,%lf", &S->in[0], &S->in[1]) == 2) {
        mdlOutputs(S, 0);
        for (int i = 0; i < 17; i++) printf("%.17g%s", S->out[i], i < 16 ? "," : "\n");
    }
    if (S->error != NULL) fprintf(stderr, "%s\n", S->error);
    mdlTerminate(S);
    return S->error != NULL;
}
