function [tau, M, C, G, rate, reading] = ${name}(q, dq, ddq, t, memory)
${comment}
%
% [tau, M, C, G, rate, reading] = ${name}(q, dq, ddq, t, memory)
%   q, dq, ddq  ${joints} x 1: encoder angles and their rates; SI units
%   t           seconds since the start of the run; 0 by default
%   memory      ${memories} x 1: ${memory_of}; zeros by default
%   tau         ${joints} x 1: torque that the drives must deliver
%   M, C, G     mass matrix with rotors, Coriolis matrix (dM/dt - 2 C is skew), gravity torque:
%               the rest of tau, friction and springs, is tau - M*ddq - C*dq - G
%   rate        ${memories} x 1: d(memory)/dt
%   reading     ${joints} x 1: reading of the torque channels at drive torque tau
if nargin < 4
    t = 0;
end
if nargin < 5
    memory = zeros(${memories}, 1);
end
sensor_shift = ${sensor_shift}; % encoders less motors, rad
link_shift = ${link_shift}; % motors less angles from the vertical, rad
at.t = t;
at.motor = q(:) - sensor_shift;
at.q = at.motor - link_shift;
at.dq = dq(:);
at.ddq = ddq(:);
at.direction = sign(dq(:));
at.load = zeros(${joints}, 1);
at.memory = memory(:);

tau = link_torque(at, link_inertia(at, zeros(${joints}, 1)));
at.load = tau;
tau = drive_torque(at, drive_inertia(at, tau));
if nargout > 1
    still = at;
    still.dq = zeros(${joints}, 1);
    still.ddq = zeros(${joints}, 1);
    G = inertial(still);
    M = zeros(${joints});
    for k = 1:${joints}
        still.ddq(k) = 1;
        M(:, k) = inertial(still) - G;
        still.ddq(k) = 0;
    end
    C = zeros(${joints});
    for k = 1:${joints}
        unit = zeros(${joints}, 1);
        unit(k) = 1;
        % The velocity torque is a quadratic form in dq; its polarization is the Christoffel matrix.
        C(:, k) = 0.5 * (velocity_torque(still, at.dq + unit, G) ...
            - velocity_torque(still, at.dq, G) - velocity_torque(still, unit, G));
    end
    rate = memory_rate(at);
    reading = torque_reading(at, tau);
end
end

function tau = inertial(at)
tau = drive_inertia(at, link_inertia(at, zeros(${joints}, 1)));
end

function tau = velocity_torque(at, dq, G)
at.dq = dq;
tau = inertial(at) - G;
end

${functions}
