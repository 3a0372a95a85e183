// A module of DUECA that estimates a person while they track: a skeleton, never run in DUECA.
//
// It reads PersonSample and writes PersonEstimate (the .dco files beside it), triggered by its input.
// Put it into a project of your own with `hoid` among its libraries, and create it by
//
//     dueca.Module("hoid-tracker", "", admin_priority).param(
//         ("set-timing", sim_timing), ("method", "adaptive"), ("options", ""))
//
// A model is fitted within a sample by methods with a warm-up: give those a priority of their own, or
// take `adaptive`, which has none.
#include <hoid.h>

#include <cmath>
#include <memory>
#include <string>

#include "comm-objects.h"
#define DO_INSTANTIATE
#include <dueca.h>
#define W_MOD
#define E_MOD
#include <debug.h>
USING_DUECA_NS;

class HoidTracker : public Module {
    typedef HoidTracker _ThisModule_;

    struct Free {
        void operator()(hoid_tracker *tracker) const { hoid_tracker_free(tracker); }
    };

    std::string method = "adaptive";
    std::string options;
    double sample_time = 0.0;
    std::unique_ptr<hoid_tracker, Free> tracker;

    ChannelReadToken r_sample;
    ChannelWriteToken w_estimate;
    Callback<HoidTracker> cb1;
    ActivityCallback do_calc;

  public:
    static const char *const classname;

    static const ParameterTable *getMyParameterTable() {
        static const ParameterTable table[] = {
            {"set-timing", new MemberCall<_ThisModule_, TimeSpec>(&_ThisModule_::setTimeSpec), set_timing_description},
            {"method", new VarProbe<_ThisModule_, std::string>(&_ThisModule_::method), "recursive method, as for hoid track"},
            {"options", new VarProbe<_ThisModule_, std::string>(&_ThisModule_::options), "options in JSON, as of pyhoid.Tracker"},
            {NULL, NULL, "Estimates a person from what they see and do, sample by sample"}};
        return table;
    }

    HoidTracker(Entity *entity, const char *part, const PrioritySpec &priority)
        : Module(entity, classname, part),
          r_sample(getId(), NameSet(getEntity(), getclassname<PersonSample>(), part), getclassname<PersonSample>(), 0,
                   Channel::Continuous),
          w_estimate(getId(), NameSet(getEntity(), getclassname<PersonEstimate>(), part), getclassname<PersonEstimate>(),
                     "estimate", Channel::Continuous),
          cb1(this, &_ThisModule_::doCalculation), do_calc(getId(), "estimate the person", &cb1, priority) {
        do_calc.setTrigger(r_sample);
    }

    bool setTimeSpec(const TimeSpec &ts) {
        if (ts.getValiditySpan() == 0) return false;
        sample_time = ts.getDtInSeconds();
        do_calc.setTimeSpec(ts);
        return true;
    }

    bool complete() {
        if (hoid_abi_version() != HOID_ABI_VERSION) {
            E_MOD("the library hoid has another interface than hoid.h");
            return false;
        }
        hoid_tracker *made = nullptr;
        if (hoid_tracker_new(method.c_str(), sample_time, options.c_str(), &made) != HOID_OK) {
            E_MOD("hoid: " << hoid_last_error());
            return false;
        }
        tracker.reset(made);
        return true;
    }

    bool isPrepared() {
        bool res = true;
        CHECK_TOKEN(r_sample);
        CHECK_TOKEN(w_estimate);
        return res;
    }

    void startModule(const TimeSpec &time) { do_calc.switchOn(time); }
    void stopModule(const TimeSpec &time) { do_calc.switchOff(time); }

    void doCalculation(const TimeSpec &ts) {
        double e = NAN, u = NAN;
        try {
            DataReader<PersonSample> sample(r_sample, ts);
            e = sample.data().e;
            u = sample.data().u;
        } catch (const std::exception &error) {
            // A sample that is lost is one that the tracker bridges.
            W_MOD("no sample at " << ts << ": " << error.what());
        }
        hoid_outcome outcome{};
        if (hoid_tracker_step(tracker.get(), e, u, &outcome) < 0) {
            E_MOD("hoid: " << hoid_last_error());
            return;
        }
        hoid_estimate operators[6], loops[2];
        const bool has_operator = is_there(hoid_tracker_operator, operators, 6);
        const bool has_loop = is_there(hoid_tracker_open_loop, loops, 2);
        DataWriter<PersonEstimate> writer(w_estimate, ts);
        PersonEstimate &y = writer.data();
        y.K_e = has_operator ? operators[0].value : NAN;
        y.K_e_se = has_operator ? operators[0].standard_error : NAN;
        y.T_L = has_operator ? operators[1].value : NAN;
        y.T_L_se = has_operator ? operators[1].standard_error : NAN;
        y.omega_nm = has_operator ? operators[3].value : NAN;
        y.zeta_nm = has_operator ? operators[4].value : NAN;
        y.tau_e = has_operator ? operators[5].value : NAN;
        y.crossover_rad_s = has_loop ? loops[0].value : NAN;
        y.phase_margin_deg = has_loop ? loops[1].value : NAN;
        y.changed = outcome.changed;
        int32_t level = HOID_NOT_DETERMINED;
        hoid_tracker_level(tracker.get(), &level);
        y.level = level;
    }

  private:
    typedef hoid_status (*List)(const hoid_tracker *, hoid_estimate *, size_t, size_t *);

    bool is_there(List list, hoid_estimate *to, size_t room) const {
        size_t count = 0;
        return list(tracker.get(), to, room, &count) == HOID_OK;
    }
};

const char *const HoidTracker::classname = "hoid-tracker";

static TypeCreator<HoidTracker> a(HoidTracker::getMyParameterTable());
