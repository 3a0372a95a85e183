// The types that DUECA generates from the .dco files.
struct PersonSample {
    double e = 0, u = 0;
    static const char *name() { return "PersonSample"; }
};
struct PersonEstimate {
    double K_e = 0, K_e_se = 0, T_L = 0, T_L_se = 0, omega_nm = 0, zeta_nm = 0, tau_e = 0, crossover_rad_s = 0,
           phase_margin_deg = 0;
    int changed = 0, level = 2;
    static const char *name() { return "PersonEstimate"; }
};
