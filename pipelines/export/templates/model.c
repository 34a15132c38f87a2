${comment}
#include "${name}.h"

#include <math.h>

${constants}

static const double sensor_shift[${joints}] = ${sensor_shift}; /* encoders less motors, rad */
/* Motors less angles from the vertical, rad. */
static const double link_shift[${joints}] = ${link_shift};

struct instant {
    double t;
    double q[${joints}], motor[${joints}], dq[${joints}], ddq[${joints}];
    double direction[${joints}], load[${joints}];
    double memory[${room}];
};

static double sign(double x) { return (x > 0.0) - (x < 0.0); }

static struct instant instant_of(double t, const double *q, const double *dq, const double *ddq,
                                 const double *memory) {
    struct instant at;
    at.t = t;
    for (int j = 0; j < ${joints}; j++) {
        at.motor[j] = q[j] - sensor_shift[j];
        at.q[j] = at.motor[j] - link_shift[j];
        at.dq[j] = dq[j];
        at.ddq[j] = ddq[j];
        at.direction[j] = sign(dq[j]);
        at.load[j] = 0.0;
    }
    for (int i = 0; i < ${room}; i++) {
        at.memory[i] = memory[i];
    }
    return at;
}

${groups}

void ${name}_inverse_dynamics(double t, const double q[${joints}], const double dq[${joints}],
                             const double ddq[${joints}], const double memory[${room}],
                             double tau[${joints}]) {
    struct instant at = instant_of(t, q, dq, ddq, memory);
    for (int j = 0; j < ${joints}; j++) {
        tau[j] = 0.0;
    }
    link_inertia(&at, tau);
    link_torque(&at, tau);
    for (int j = 0; j < ${joints}; j++) {
        at.load[j] = tau[j];
    }
    drive_inertia(&at, tau);
    drive_torque(&at, tau);
}

void ${name}_bias(double t, const double q[${joints}], const double dq[${joints}],
                 const double memory[${room}], double tau[${joints}]) {
    const double still[${joints}] = {0.0};
    ${name}_inverse_dynamics(t, q, dq, still, memory, tau);
}

void ${name}_mass_matrix(double t, const double q[${joints}], double M[${joints}][${joints}]) {
    const double still[${joints}] = {0.0}, no_memory[${room}] = {0.0};
    struct instant at = instant_of(t, q, still, still, no_memory);
    double at_rest[${joints}] = {0.0};
    link_inertia(&at, at_rest);
    drive_inertia(&at, at_rest);
    for (int k = 0; k < ${joints}; k++) {
        double column[${joints}] = {0.0};
        at.ddq[k] = 1.0;
        link_inertia(&at, column);
        drive_inertia(&at, column);
        at.ddq[k] = 0.0;
        for (int j = 0; j < ${joints}; j++) {
            M[j][k] = column[j] - at_rest[j];
        }
    }
}

void ${name}_memory_rate(double t, const double q[${joints}], const double dq[${joints}],
                        const double memory[${room}], double rate[${room}]) {
    const double still[${joints}] = {0.0};
    struct instant now = instant_of(t, q, dq, still, memory), *at = &now;
    (void)at;
    for (int i = 0; i < ${room}; i++) {
        rate[i] = 0.0;
    }
${rates}}

void ${name}_torque_reading(double t, double tau[${joints}]) {
    struct instant now = {.t = t}, *at = &now;
    (void)at;
    (void)tau;
${readings}}
