${comment}
#ifndef ${GUARD}
#define ${GUARD}

#ifdef __cplusplus
extern "C" {
#endif

#define ${NAME}_JOINTS ${joints}
#define ${NAME}_MEMORY ${room} ${memory_comment}

/* Torque that the drives must deliver. t: seconds since the start of the run; q, dq, ddq: encoder
 * angles and their rates, SI units; memory: ${NAME}_MEMORY numbers, initially 0.
 * Load-dependent friction makes it nonlinear in ddq. */
void ${name}_inverse_dynamics(double t, const double q[${joints}], const double dq[${joints}],
                             const double ddq[${joints}], const double memory[${room}],
                             double tau[${joints}]);

/* The same at ddq = 0: Coriolis and centrifugal torque, gravity, friction, springs. */
void ${name}_bias(double t, const double q[${joints}], const double dq[${joints}],
                 const double memory[${room}], double tau[${joints}]);

/* Mass matrix with rotors. */
void ${name}_mass_matrix(double t, const double q[${joints}], double M[${joints}][${joints}]);

/* Rate of the memory, to be integrated by the caller. */
void ${name}_memory_rate(double t, const double q[${joints}], const double dq[${joints}],
                        const double memory[${room}], double rate[${room}]);

/* Reading of the torque channels at drive torque tau; in place. */
void ${name}_torque_reading(double t, double tau[${joints}]);

#ifdef __cplusplus
}
#endif
#endif
