// The same as tracker.c without its options, with a tracker that frees itself and errors as exceptions.
//
//     tracker_cpp METHOD SAMPLE_TIME
#include <hoid.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <vector>

class Tracker {
  public:
    Tracker(const char *method, double sample_time, const char *options = nullptr) {
        hoid_tracker *made = nullptr;
        check(hoid_tracker_new(method, sample_time, options, &made));
        tracker_.reset(made);
    }

    hoid_outcome step(double e, double u) {
        hoid_outcome outcome{};
        check(hoid_tracker_step(tracker_.get(), e, u, &outcome));
        return outcome;
    }

    // Empty while there is no estimate.
    std::vector<hoid_estimate> estimate() const {
        std::vector<hoid_estimate> all(6);
        std::size_t count = 0;
        if (!check(hoid_tracker_operator(tracker_.get(), all.data(), all.size(), &count))) count = 0;
        all.resize(count);
        return all;
    }

  private:
    static bool check(hoid_status status) {
        if (status < 0) throw std::runtime_error(hoid_last_error());
        return status == HOID_OK;
    }

    struct Free {
        void operator()(hoid_tracker *tracker) const { hoid_tracker_free(tracker); }
    };
    std::unique_ptr<hoid_tracker, Free> tracker_;
};

int main(int argc, char **argv) {
    if (argc < 3) {
        std::fprintf(stderr, "usage: tracker_cpp METHOD SAMPLE_TIME\n");
        return 2;
    }
    try {
        Tracker tracker(argv[1], std::atof(argv[2]));
        double e, u;
        while (std::scanf("%lf,%lf", &e, &u) == 2) {
            hoid_outcome outcome = tracker.step(e, u);
            for (const hoid_estimate &estimate : tracker.estimate()) {
                std::printf("%.17g,%.17g,", estimate.value, estimate.standard_error);
            }
            std::printf("%.17g\n", outcome.innovation);
        }
    } catch (const std::exception &error) {
        std::fprintf(stderr, "hoid: %s\n", error.what());
        return 1;
    }
}
