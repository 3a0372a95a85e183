// Runs the module on lines "e,u", as DUECA would: it calls the functions of the module in their order.
#include "../../../examples/dueca/HoidTracker.cxx"

#include <cstdio>

static PersonSample sample;
static PersonEstimate estimate;

ChannelReadToken::ChannelReadToken(const GlobalId &, const NameSet &, const char *, int, Channel::Kind) {
    data = &sample;
}
ChannelWriteToken::ChannelWriteToken(const GlobalId &, const NameSet &, const char *, const char *, Channel::Kind) {
    data = &estimate;
}

int main() {
    Entity entity;
    TimeSpec ts{0.01, 0.0};
    HoidTracker module(&entity, "", PrioritySpec());
    if (module.setTimeSpec(TimeSpec{0.0, 0.0}) || !module.setTimeSpec(ts)) return 3;
    if (!module.complete() || !module.isPrepared()) return 1;
    module.startModule(ts);
    while (std::scanf("%lf,%lf", &sample.e, &sample.u) == 2) {
        module.doCalculation(ts);
        ts.at += ts.dt;
        std::printf("%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", estimate.K_e, estimate.K_e_se, estimate.T_L,
                    estimate.T_L_se, estimate.omega_nm, estimate.zeta_nm, estimate.tau_e);
    }
    module.stopModule(ts);
}
