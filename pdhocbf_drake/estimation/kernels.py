"""The contact-aided invariant Kalman filter's arithmetic as machine code.

The estimate is a vector (27,) of base orientation R, row by row, velocity v and place p of the base, places of the left
and right sole, and biases of gyroscope and accelerometer. Its errors (33,) are ordered as `PHI` to `OFFSETS`; the last
twelve, of the joints' encoders, are considered and never corrected (Schmidt). With the group element X of R, v, p and
soles, the error is right-invariant: X̂ = exp(ξ) X, bias error b̂ − b, encoder error measured − true.

Each kernel writes into the arrays that it is given; `tests/test_estimation_kernels.py` holds a plain reference of each.
"""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled

R, V, P, SOLES, GYRO_BIAS, ACCELEROMETER_BIAS, ESTIMATE = 0, 9, 12, 15, 21, 24, 27
"""Places in the estimate: a part begins at its number; the last one is the estimate's size."""

PHI, DV, DP, DSOLES, DGYRO, DACCELEROMETER, OFFSETS, ERRORS = 0, 3, 6, 9, 15, 18, 21, 33
"""Places in the errors, likewise; `OFFSETS` are twelve encoders, in the order of the joints."""

_SMALL = 1e-8  # [rad²]: below it a rotation's series is used


@compiled
def rotate(rotation: np.ndarray, vector: np.ndarray, out: np.ndarray) -> None:
    """R a, with R (9,) row by row."""
    x, y, z = vector[0], vector[1], vector[2]
    for i in range(3):
        out[i] = rotation[3 * i] * x + rotation[3 * i + 1] * y + rotation[3 * i + 2] * z


@compiled
def write_exp(vector: np.ndarray, out: np.ndarray) -> None:
    """exp(a^) of a rotation vector (3,) by Rodrigues' formula, row by row (9,)."""
    x, y, z = vector[0], vector[1], vector[2]
    square = x * x + y * y + z * z
    if square < _SMALL:
        s, c = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        angle = math.sqrt(square)
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    out[0], out[4], out[8] = 1.0 - c * (y * y + z * z), 1.0 - c * (x * x + z * z), 1.0 - c * (x * x + y * y)
    out[1], out[3] = c * x * y - s * z, c * x * y + s * z
    out[2], out[6] = c * x * z + s * y, c * x * z - s * y
    out[5], out[7] = c * y * z - s * x, c * y * z + s * x


@compiled
def write_log(rotation: np.ndarray, out: np.ndarray) -> None:
    """The rotation vector (3,) of R (9,), below half a revolution."""
    out[0] = 0.5 * (rotation[7] - rotation[5])
    out[1] = 0.5 * (rotation[2] - rotation[6])
    out[2] = 0.5 * (rotation[3] - rotation[1])
    sine = math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    cosine = 0.5 * (rotation[0] + rotation[4] + rotation[8] - 1.0)
    if sine * sine > _SMALL:
        factor = math.atan2(sine, cosine) / sine
        for i in range(3):
            out[i] *= factor


@compiled
def write_turned(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """A B of two rotations (9,); `out` is none of them."""
    for i in range(0, 9, 3):
        for j in range(3):
            out[i + j] = a[i] * b[j] + a[i + 1] * b[3 + j] + a[i + 2] * b[6 + j]


@compiled
def orthonormalize(rotation: np.ndarray) -> None:
    """One step of R ← R (3 − Rᵀ R)/2, which takes rounding out of a rotation (9,)."""
    gram, old = np.empty(9), rotation.copy()
    for i in range(3):
        for j in range(3):
            gram[3 * i + j] = -0.5 * (old[i] * old[j] + old[3 + i] * old[3 + j] + old[6 + i] * old[6 + j])
        gram[4 * i] += 1.5
    write_turned(old, gram, rotation)


@compiled
def set_skew(vector: np.ndarray, scale: float, row: int, column: int, out: np.ndarray) -> None:
    """Writes scale · a^ into a block of a matrix."""
    x, y, z = scale * vector[0], scale * vector[1], scale * vector[2]
    out[row, column + 1], out[row, column + 2] = -z, y
    out[row + 1, column], out[row + 1, column + 2] = z, -x
    out[row + 2, column], out[row + 2, column + 1] = -y, x


@compiled
def propagate(
    estimate: np.ndarray, covariance: np.ndarray, imu: np.ndarray, gravity: np.ndarray, tick: float, noise: np.ndarray,
) -> None:  # fmt: skip
    """Moves estimate (27,) and covariance (33, 33) over a tick by what the IMU measured in it.

    R ← R exp(Δθ),  v ← v + R Δv + g δ,  p ← p + v δ + ½ (R Δv + g δ) δ, with Δθ and Δv less what the biases add to
    them. The error's rate is ξ̇ = A ξ, A of R, v, p, soles and g; here exp(A δ) to second order, with these at the
    tick's middle.

    Args:
        imu: mean rate [rad/s] and specific force [m/s²] over the tick in the axes at its start, (6,) or more.
        gravity: g (3,) [m/s²]. tick: δ [s].
        noise: densities, squared, of gyroscope, accelerometer, a standing sole's place, and the walk of the gyroscope's
            and of the accelerometer's bias (5,).
    """
    turn, push, step = np.empty(3), np.empty(3), np.empty(9)
    for i in range(3):
        turn[i] = 0.5 * tick * (imu[i] - estimate[GYRO_BIAS + i])
    for i in range(3):  # the force was joined by the IMU at rates with their bias, b × f δ/2 too far
        j, k = (i + 1) % 3, (i + 2) % 3
        crossed_force = estimate[GYRO_BIAS + j] * imu[3 + k] - estimate[GYRO_BIAS + k] * imu[3 + j]
        push[i] = tick * (imu[3 + i] - 0.5 * tick * crossed_force)
    middle, gain, slowed = np.empty(9), np.empty(3), np.empty(3)
    write_exp(turn, step)
    write_turned(estimate[R : R + 9], step, middle)
    rotate(estimate[R : R + 9], push, gain)
    rotate(middle, estimate[ACCELEROMETER_BIAS : ACCELEROMETER_BIAS + 3], slowed)
    velocity, place = estimate[V : V + 3].copy(), estimate[P : P + 3].copy()
    for i in range(3):
        gain[i] += tick * (gravity[i] - slowed[i])
        estimate[P + i] += tick * (estimate[V + i] + 0.5 * gain[i])
        estimate[V + i] += gain[i]
        velocity[i] += 0.5 * gain[i]
        place[i] = 0.5 * (place[i] + estimate[P + i])
    write_turned(middle, step, estimate[R : R + 9])
    orthonormalize(estimate[R : R + 9])
    change = np.zeros((DGYRO, OFFSETS))  # exp(A δ) − 1, its rows other than zero
    set_skew(gravity, tick, DV, PHI, change)
    set_skew(gravity, 0.5 * tick * tick, DP, PHI, change)
    crossed, arm = np.zeros((3, 3)), np.empty((3, 3))
    for part in range(6):  # what a gyroscope's bias does to R, v, p and soles, then to v by the tilt's gravity
        if part == 1:
            set_skew(velocity, 1.0, 0, 0, crossed)
        elif part == 2:
            set_skew(place, 1.0, 0, 0, crossed)
        elif part == 5:
            set_skew(gravity, 1.0, 0, 0, crossed)
        elif part > 2:
            start = SOLES + 3 * (part - 3)
            set_skew(estimate[start : start + 3], 1.0, 0, 0, crossed)
        for i in range(3):
            for j in range(3):
                arm[i, j] = middle[3 * i + j] if part == 0 else 0.0
                for k in range(3):
                    arm[i, j] += crossed[i, k] * middle[3 * k + j]
                if part < 5:
                    change[3 * part + i, DGYRO + j] -= tick * arm[i, j]
                else:
                    change[DV + i, DGYRO + j] -= 0.5 * tick * tick * arm[i, j]
                if part == 1:
                    change[DP + i, DGYRO + j] -= 0.5 * tick * tick * arm[i, j]
    for i in range(3):
        change[DP + i, DV + i] = tick
        for j in range(3):
            change[DV + i, DACCELEROMETER + j] = -tick * middle[3 * i + j]
            change[DP + i, DACCELEROMETER + j] = -0.5 * tick * tick * middle[3 * i + j]
    carry(change, covariance)
    spread = np.zeros((DGYRO, 3))  # of the gyroscope's noise, [1; v^; p^; soles^] but for the rotation of the noise
    for i in range(3):
        spread[i, i] = 1.0
    set_skew(velocity, 1.0, DV, 0, spread)
    set_skew(place, 1.0, DP, 0, spread)
    set_skew(estimate[SOLES : SOLES + 3], 1.0, DSOLES, 0, spread)
    set_skew(estimate[SOLES + 3 : SOLES + 6], 1.0, DSOLES + 3, 0, spread)
    for i in range(DGYRO):
        for j in range(DGYRO):
            dot = spread[i, 0] * spread[j, 0] + spread[i, 1] * spread[j, 1] + spread[i, 2] * spread[j, 2]
            covariance[i, j] += noise[0] * tick * dot
    for i in range(3):
        covariance[DV + i, DV + i] += noise[1] * tick
        covariance[DGYRO + i, DGYRO + i] += noise[3] * tick
        covariance[DACCELEROMETER + i, DACCELEROMETER + i] += noise[4] * tick
    for i in range(DSOLES, DGYRO):
        covariance[i, i] += noise[2] * tick


@compiled
def carry(change: np.ndarray, covariance: np.ndarray) -> None:
    """P ← (1 + C) P (1 + C)ᵀ, for the first rows and columns of the change C other than zero."""
    rows, columns = change.shape
    size = len(covariance)
    added = np.zeros((rows, size))
    for i in range(rows):
        for k in range(columns):
            factor = change[i, k]
            if factor != 0.0:
                for j in range(size):
                    added[i, j] += factor * covariance[k, j]
    for i in range(rows):
        for j in range(size):
            covariance[i, j] += added[i, j]
    for i in range(size):
        for j in range(rows):
            total = 0.0
            for k in range(columns):
                if change[j, k] != 0.0:
                    total += covariance[i, k] * change[j, k]
            added[j, i] = total
    for i in range(size):
        for j in range(rows):
            covariance[i, j] += added[j, i]


@compiled
def place_sole(
    estimate: np.ndarray, covariance: np.ndarray, side: int, way: np.ndarray, rates: np.ndarray, variance: float,
) -> None:  # fmt: skip
    """Puts a sole where the joints place it, d = p + R s, with the error that this has.

    Args:
        side: 0 left, 1 right. way: s, from the base in its axes (3,) [m]. rates: ∂s/∂θ, (3, 12) [m/rad].
        variance: of s besides the encoders' errors [m²].
    """
    first, out = DSOLES + 3 * side, np.empty(3)
    rotation = estimate[R : R + 9]
    rotate(rotation, way, out)
    turned = np.empty((3, rates.shape[1]))
    for i in range(3):
        estimate[SOLES + 3 * side + i] = estimate[P + i] + out[i]
        for j in range(rates.shape[1]):
            turned[i, j] = rotation[3 * i] * rates[0, j] + rotation[3 * i + 1] * rates[1, j]
            turned[i, j] += rotation[3 * i + 2] * rates[2, j]
    for i in range(3):
        for j in range(ERRORS):
            if first <= j < first + 3:
                continue
            total = covariance[DP + i, j]
            for k in range(rates.shape[1]):
                total += turned[i, k] * covariance[OFFSETS + k, j]
            covariance[first + i, j] = covariance[j, first + i] = total
    for i in range(3):
        for j in range(3):
            total = covariance[first + i, DP + j]
            for k in range(rates.shape[1]):
                total += turned[j, k] * covariance[first + i, OFFSETS + k]
            covariance[first + i, first + j] = total
    for i in range(3):
        covariance[first + i, first + i] += variance


@compiled
def update(
    estimate: np.ndarray, covariance: np.ndarray, rows: np.ndarray, residuals: np.ndarray, variances: np.ndarray,
) -> float:  # fmt: skip
    """Corrects estimate and covariance by z = H ξ + noise; the innovations' squares, zᵀ S⁻¹ z, S = H P Hᵀ + noise.

    With S = L Lᵀ and Y = P Hᵀ L⁻ᵀ, built row by row: ξ = Y L⁻¹ z, P ← P − Y Yᵀ. The encoders' errors have no gain
    (Schmidt): ξ and the block of P that is theirs alone stay, which is exact for the gain of the others.

    Args:
        rows: H (m, 33). residuals: z (m,). variances: of the noise (m,).
    """
    count, nis = len(rows), 0.0
    error, ways, white = np.zeros(ERRORS), np.empty((count, ERRORS)), np.empty(count)
    for row in range(count):
        way, left, total = ways[row], residuals[row], variances[row]
        for i in range(ERRORS):
            way[i] = 0.0
        for k in range(ERRORS):
            factor = rows[row, k]
            if factor != 0.0:
                for i in range(ERRORS):
                    way[i] += covariance[k, i] * factor
        for before in range(row):
            shared = 0.0
            for k in range(ERRORS):
                shared += rows[row, k] * ways[before, k]
            left -= shared * white[before]
            for i in range(ERRORS):
                way[i] -= shared * ways[before, i]
        for k in range(ERRORS):
            total += rows[row, k] * way[k]
        root = math.sqrt(total)
        white[row] = left / root
        nis += white[row] * white[row]
        for i in range(ERRORS):
            way[i] /= root
        for i in range(OFFSETS):
            error[i] += way[i] * white[row]
    for i in range(OFFSETS):
        for j in range(i, ERRORS):
            total = covariance[i, j]
            for row in range(count):
                total -= ways[row, i] * ways[row, j]
            covariance[i, j] = covariance[j, i] = total
    correct(estimate, error)
    return nis


@compiled
def correct(estimate: np.ndarray, error: np.ndarray) -> None:
    """X̂ ← exp(−ξ) X̂ and b̂ ← b̂ − ξ_b."""
    turn, step, old = np.empty(3), np.empty(9), estimate[R : R + 9].copy()
    for i in range(3):
        turn[i] = -error[PHI + i]
    write_exp(turn, step)
    write_turned(step, old, estimate[R : R + 9])
    left, out, moved = left_jacobian(turn), np.empty(3), np.empty(3)
    for part in range(4):
        at = V + 3 * part
        rotate(step, estimate[at : at + 3], out)
        for i in range(3):
            moved[i] = -error[DV + 3 * part + i]
        for i in range(3):
            estimate[at + i] = out[i] + left[i, 0] * moved[0] + left[i, 1] * moved[1] + left[i, 2] * moved[2]
    for i in range(6):
        estimate[GYRO_BIAS + i] -= error[DGYRO + i]


@compiled
def left_jacobian(vector: np.ndarray) -> np.ndarray:
    """J(a) = 1 + (1 − cos)/|a|² a^ + (|a| − sin)/|a|³ a^ a^, (3, 3): exp of the group moves places by J(φ) δ."""
    x, y, z = vector[0], vector[1], vector[2]
    square = x * x + y * y + z * z
    if square < _SMALL:
        c, d = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        angle = math.sqrt(square)
        c, d = (1.0 - math.cos(angle)) / square, (angle - math.sin(angle)) / (angle * square)
    out = np.empty((3, 3))
    out[0, 0], out[1, 1], out[2, 2] = 1.0 - d * (y * y + z * z), 1.0 - d * (x * x + z * z), 1.0 - d * (x * x + y * y)
    out[0, 1], out[1, 0] = d * x * y - c * z, d * x * y + c * z
    out[0, 2], out[2, 0] = d * x * z + c * y, d * x * z - c * y
    out[1, 2], out[2, 1] = d * y * z - c * x, d * y * z + c * x
    return out


@compiled
def write_imu(
    state: np.ndarray, integrals: np.ndarray, noise: np.ndarray, numbers: np.ndarray, samples: int, time: float,
    out: np.ndarray,
) -> None:  # fmt: skip
    """One sample of the IMU joined to those of its tick, see `systems.sensors.Imu`: its output (9,), then its state.

    Args:
        state: samples so far, last integrals (6), bias (6), ΔR (9), Δv (3). noise: standard normal numbers (12,).
        numbers: deviation of white noise, of a step of the bias, range and rounding, of the six axes (4, 6).
        samples: of a tick. time: of a sample [s].
    """
    for i in range(9):
        out[i] = 0.0
    after = out[9:]
    count = state[0] if state[0] < samples else 0.0
    for i in range(6):
        after[1 + i] = integrals[i]
        after[7 + i] = state[7 + i] + numbers[1, i] * noise[6 + i]
    for i in range(12):
        after[13 + i] = state[13 + i]
    if count <= 0.0:
        for i in range(12):
            after[13 + i] = 1.0 if i == 0 or i == 4 or i == 8 else 0.0
    after[0] = count + 1.0
    if count < 0.0:
        return
    sample, turn, step, middle, push = np.empty(6), np.empty(3), np.empty(9), np.empty(9), np.empty(3)
    for i in range(6):
        value = (integrals[i] - state[1 + i]) / time + state[7 + i] + numbers[0, i] * noise[i]
        value = min(max(value, -numbers[2, i]), numbers[2, i])
        sample[i] = numbers[3, i] * math.floor(value / numbers[3, i] + 0.5)
    for i in range(3):
        turn[i] = 0.5 * time * sample[i]
    write_exp(turn, step)
    write_turned(after[13:22], step, middle)
    rotate(middle, sample[3:6], push)
    write_turned(middle, step, after[13:22])
    for i in range(3):
        after[22 + i] += time * push[i]
    write_log(after[13:22], turn)
    for i in range(3):
        out[i] = turn[i] / (samples * time)
        out[3 + i] = after[22 + i] / (samples * time)
        out[6 + i] = sample[i]


@compiled
def write_rows(
    estimate: np.ndarray, side: int, way: np.ndarray, way_rates: np.ndarray, turn: np.ndarray, turn_rates: np.ndarray,
    spin: np.ndarray, rows: np.ndarray, residuals: np.ndarray,
) -> None:  # fmt: skip
    """H (7, 33) and z (7,) of a standing foot, see `contact_ekf.ContactEkf`.

    Args:
        side: 0 left, 1 right. way, turn: place (3,) and rotation (9,) of the sole in the base. way_rates, turn_rates:
            what a joint's rate adds to their rates, (3, 12). spin: Ω, the sole's mean rate in the base's axes (3,).
    """
    rotation, sole, first, count = estimate[R : R + 9], SOLES + 3 * side, DSOLES + 3 * side, way_rates.shape[1]
    for i in range(len(rows)):
        for j in range(ERRORS):
            rows[i, j] = 0.0
    reached, normal, turned = np.empty(3), np.empty(3), np.empty(3)
    rotate(rotation, way, reached)
    for i in range(3):
        residuals[i] = reached[i] - estimate[sole + i] + estimate[P + i]
        rows[i, DP + i], rows[i, first + i] = 1.0, -1.0
        turned[i] = turn[3 * i + 2]
    rotate(rotation, turned, normal)
    residuals[3], residuals[4] = normal[0], normal[1]
    rows[3, PHI + 1], rows[4, PHI] = 1.0, -1.0
    for j in range(count):
        for i in range(3):
            reached[i], turned[i] = way_rates[i, j], turn_rates[i, j]
        for i in range(3):
            row = vector_of(rotation, i)
            rows[i, OFFSETS + j] = row[0] * reached[0] + row[1] * reached[1] + row[2] * reached[2]
        row = vector_of(rotation, 1)
        rows[3, OFFSETS + j] = row[0] * turned[0] + row[1] * turned[1] + row[2] * turned[2]
        row = vector_of(rotation, 0)
        rows[4, OFFSETS + j] = -(row[0] * turned[0] + row[1] * turned[1] + row[2] * turned[2])
    residuals[5] = estimate[sole + 2]
    rows[5, PHI], rows[5, PHI + 1], rows[5, first + 2] = estimate[sole + 1], -estimate[sole], 1.0
    residuals[6] = rotation[6] * spin[0] + rotation[7] * spin[1] + rotation[8] * spin[2]
    rows[6, DGYRO], rows[6, DGYRO + 1], rows[6, DGYRO + 2] = -rotation[6], -rotation[7], -rotation[8]


@compiled
def vector_of(rotation: np.ndarray, row: int) -> tuple[float, float, float]:
    """A row of R (9,)."""
    return rotation[3 * row], rotation[3 * row + 1], rotation[3 * row + 2]


@compiled
def farthest(covariance: np.ndarray, rows: np.ndarray, residuals: np.ndarray, variances: np.ndarray) -> float:
    """The largest |z|/√(h P hᵀ + r) of single rows."""
    most = 0.0
    for row in range(len(rows)):
        total = variances[row]
        for i in range(ERRORS):
            if rows[row, i] != 0.0:
                for j in range(ERRORS):
                    if rows[row, j] != 0.0:
                        total += rows[row, i] * covariance[i, j] * rows[row, j]
        most = max(most, abs(residuals[row]) / math.sqrt(total))
    return most


@compiled
def write_spin(rate: np.ndarray, tick: float, before: np.ndarray, now: np.ndarray, out: np.ndarray) -> None:
    """A sole's mean rate over a tick in the base's axes at its start: log(exp(ω δ) F Fᵀ_before)/δ.

    Args:
        rate: of the base (3,) [rad/s]. tick: δ [s]. before, now: the sole's rotation in the base (9,).
    """
    turn, step, here, back, all_of_it = np.empty(3), np.empty(9), np.empty(9), np.empty(9), np.empty(9)
    for i in range(3):
        turn[i] = tick * rate[i]
        for j in range(3):
            back[3 * i + j] = before[3 * j + i]
    write_exp(turn, step)
    write_turned(step, now, here)
    write_turned(here, back, all_of_it)
    write_log(all_of_it, out)
    for i in range(3):
        out[i] /= tick
