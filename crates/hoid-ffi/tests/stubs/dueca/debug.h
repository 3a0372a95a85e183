// Substitute for DUECA's debug.h: messages are written to standard error.
#undef W_MOD
#undef E_MOD
#define W_MOD(A) (std::cerr << A << '\n')
#define E_MOD(A) (std::cerr << A << '\n')
