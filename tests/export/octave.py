"""Exported functions, run by Octave."""

import subprocess
from pathlib import Path

import numpy as np

SCRIPT = """\
states = dlmread('states.csv');
names = {{{names}}};
for i = 1:numel(names)
    f = str2func(names{{i}});
    out = [];
    for k = 1:rows(states)
        s = states(k, :)';
        q = s(2:{J} + 1);
        dq = s({J} + 2:2 * {J} + 1);
        ddq = s(2 * {J} + 2:end);
        if k == 1
            % As many numbers as the function says that it remembers.
            [~, ~, ~, ~, rate] = f(q, dq, ddq);
            memory = {memory} * ones(numel(rate), 1);
        end
        [tau, M, C, G, rate, reading] = f(q, dq, ddq, s(1), memory);
        out(k, :) = [tau; reading; M(:); C(:); G; rate]';
    end
    file = fopen([names{{i}} '.out'], 'w');
    fprintf(file, [repmat('%.17g,', 1, columns(out) - 1) '%.17g\\n'], out');
    fclose(file);
end
"""


def computed(folder: Path, stems, states, memory) -> dict[str, dict[str, np.ndarray]]:
    """Run the functions of a folder at all instants."""
    J = states.q.shape[1]
    rows = np.column_stack([states.t, states.q, states.dq, states.ddq])
    np.savetxt(folder / "states.csv", rows, fmt="%.17g", delimiter=",")
    (folder / "run_all.m").write_text(
        SCRIPT.format(names=", ".join(f"'{s}'" for s in stems), memory=memory, J=J)
    )
    command = ["octave-cli", "--no-init-file", "--quiet", "run_all.m"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    found = {}
    for stem in stems:
        out = np.loadtxt(folder / f"{stem}.out", delimiter=",", ndmin=2)
        ends = np.cumsum([J, J, J * J, J * J, J])
        tau, reading, M, C, G, rate = np.split(out, ends, axis=1)
        # Octave's matrices go by columns.
        M, C = (part.reshape(-1, J, J).transpose(0, 2, 1) for part in (M, C))
        found[stem] = {"tau": tau, "reading": reading, "M": M, "C": C, "G": G, "rate": rate}
    return found
