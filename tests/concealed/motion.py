"""Equations of motion and their integration: Dormand-Prince 5(4), steps located on events.

One parameter vector describes a rig with everything that may act in it; an entry left at zero does not act.
Positions are along x, positive into the stop, SI throughout. State:
  0 x, 1 v      body                       2 xb, 3 vb    stop (base compliance) or transducer tip (sensor resonance)
  4 xl, 5 vl    loose part                 6 z           bristle of the LuGre friction [m]
  7 .. 14       forces in the Maxwell branches [N]
  15 xa, 16 va  mass that rides on the body by a spring
Memory that a step leaves alone and events change: deepest indentation, turning depth, crack flag.
"""
import math

import numpy as np
from numba import njit

# --- parameter vector -------------------------------------------------------------------------------------------
M, K, PW, MU, G = 0, 1, 2, 3, 4                  # mass, stiffness, exponent, hysteresis damping, gravity
SP_PRE, SP_K, TRAVEL = 5, 6, 7                   # spring at rest, its rate, way to the stop
KFAC = 8                                         # factor on the contact's stiffness (scatter, softening, temperature)
CQ, CQ_Q = 10, 11                                # c x^q v: Kuwabara-Kono (q = p - 1), Tsuji (q = 1/4)
CV, CV_RAMP, CV_THIN = 12, 13, 14                # c v, depth of its ramp, speed of shear thinning
PL, PL_Y, PL_R = 15, 16, 17                      # plasticity: form, yield depth, ratio
AD, AD_F, AD_R = 18, 19, 20                      # adhesion: form, pull-off force, range
ST_K, ST_D, ST_P = 21, 22, 23                    # second layer: stiffness, depth, exponent
FR, FR_C, FR_S, FR_VS, FR_V = 24, 25, 26, 27, 28  # guide friction: form, Coulomb, static, Stribeck speed, viscous
FR_SIG = 29                                      # LuGre bristle stiffness
DRAG, DRAG_N, DRAG_BACK = 30, 31, 32             # c |v|^(n-1) v, factor on the way back
SQ, SQ_G, SQ_N, SQ_CUT = 33, 34, 35, 36          # squeeze film: c v (g0/(gap+g0))^n below the cut-off
BMODE, MB, KB, CB, KB3 = 37, 38, 39, 40, 41      # 1: moving stop, 2: transducer tip; mass, spring, dashpot, cubic
LM, LGAP, LK, LC, LP, LTWO = 42, 43, 44, 45, 46, 47  # loose part: mass, gap, stiffness, dashpot, exponent, both ways
MG_F, MG_Z, MG_T = 48, 49, 50                    # magnet: force at rest, gap scale, time scale (0: does not fade)
JAM, JAM_X, JAM_W = 51, 52, 53                   # unknown: a tight spot in the guide
CRACK_F, CRACK_D = 54, 55                        # unknown: the contact cracks
CORR_F, CORR_W = 56, 57                          # unknown: corrugated surface
RATE, RATE_V = 58, 59                            # unknown: stiffness that grows with speed
VE_N, VE_KIND = 60, 61                           # Maxwell branches: how many, on x (0) or on x^p (1)
VE_K, VE_T = 62, 70                              # eight stiffnesses, eight time constants
ST_W, PL_M, SP_K3, MG_EDDY = 78, 79, 80, 81      # width of a layer's onset, power of a return, cubic spring, eddy fade
VIB, VIB_W, VIB_PH = 82, 83, 84                  # unknown: the rig is shaken: force, angular frequency, phase
CV_POW, MU_THIN, SP_X2, SP_K2 = 85, 86, 87, 88   # power of speed in c v, speed that thins mu; second spring: from where, rate
DRAG_CR = 89                                     # speed of the drag crisis (0: none)
MU_POW, ST2_K, ST2_D, CB_DRY = 90, 91, 92, 93    # power of speed in mu x^p v; third layer: rate, depth; dry friction of the stop
DRAG_LIN = 94                                    # speed at which the drag's linear share is as large as its square
PRE, PRE_F, PRE_D, PRE_SAG = 95, 96, 97, 98      # contact spring under preload: form, force, depth it takes, share lost at depth
PRE_X = 99                                       # depth at which PRE_SAG is lost
AM, AM_K, AM_C, AM_K3, AM_DRY, AM_GAP = 100, 101, 102, 103, 104, 105  # riding mass: mass, spring, dashpot, cubic, dry friction, play to each side
LOSS, LOSS_V = 106, 107                          # rate-independent loss of the contact: share of force, speed that smooths its sign
WIG = 108                                        # wiggles of the law: WIG_N times amplitude (of force), wave number [rad/m], phase
WIG_N = 3
PLAT, PLAT_X, PLAT_W = 117, 118, 119             # stranger: a wall that gives way: share of force lost, depth, width
TH, TH_V, TH_D = 120, 121, 122                   # stranger: damping that sets in beyond a speed: N s^2/m^2, speed, depth of its ramp
SKIN_F, SKIN_D = 123, 124                        # stranger: a skin that breaks: force it bears, depth at which it breaks
SIDE = 125                                       # stranger: friction in the guide in proportion to the contact's force
LA_F, LA_Z = 126, 127                            # stranger: a latch's pull towards the stop, distance over which it fades
PAWL = 128                                       # stranger: friction on the way back only
NP = 129
NS = 17
VE_END = 15          # behind the last Maxwell branch
COUNTS = ("NP", "NS", "VE_END", "WIG_N")     # numbers above that are no index of a parameter
CREEP = 2e-3         # m/s, width of the smoothed zero of dry friction in the stop's seat and under a riding mass


@njit(cache=True)
def virgin(x, P):
    """Force of the first loading without damping [N]; Thornton's goes on straight beyond yield."""
    if x <= 0.0:
        return 0.0
    k, p = P[K] * P[KFAC], P[PW]
    if P[PL] == 3.0 and x > P[PL_Y]:
        y = P[PL_Y]
        return k * y ** p + p * k * y ** (p - 1.0) * (x - y)
    return k * x ** p


@njit(cache=True)
def skeleton(x, deepest, P):
    """Force without rate [N]: power law, or the branch that plasticity returns on.

    1 permanent set a (deepest - y), same exponent. 2 Walton and Braun 1986: straight return, steeper than the
    tangent by the ratio. 3 Thornton 1997: return with the radius grown as the load it lost. 4 Oliver and Pharr 1992:
    return with its own power, to a set that grows with the square of what lies beyond yield.
    """
    if x <= 0.0:
        return 0.0
    if P[PL] == 0.0 or x >= deepest or deepest <= P[PL_Y]:
        return virgin(x, P)
    p = P[PW]
    top = virgin(deepest, P)
    if P[PL] == 1.0:
        d = P[PL_R] * (deepest - P[PL_Y])
        if x <= d:
            return 0.0
        return top * ((x - d) / (deepest - d)) ** p
    if P[PL] == 2.0:
        k2 = P[PL_R] * p * top / deepest
        return max(0.0, min(virgin(x, P), top - k2 * (deepest - x)))
    if P[PL] == 4.0:
        d = P[PL_R] * (deepest - P[PL_Y]) ** 2 / deepest
        return top * ((x - d) / (deepest - d)) ** P[PL_M] if x > d else 0.0
    k = P[K] * P[KFAC]
    ku = k * math.sqrt(k * deepest ** p / top)
    d = deepest - (top / ku) ** (1.0 / p)
    if x <= d:
        return 0.0
    return ku * (x - d) ** p


@njit(cache=True)
def pull(x, leaving, turn, P):
    """Adhesive pull [N, positive away from the stop's surface inwards]; may act out to x = -range.

    1 neck: only while leaving, full at the surface. 2 JKR-like: c x^(p/2), the neck holds to -range while leaving.
    3 reversible: full in contact, falls to zero over the range, both ways. 4 a meniscus: only while leaving, near the
    surface, outside falling with the square of the distance until it tears at -range.
    """
    f, r = P[AD_F], P[AD_R]
    if P[AD] == 1.0:
        if leaving == 0 or x < -r or turn <= 0.0:
            return 0.0
        grow = min(1.0, (turn - x) / (0.3 * turn))
        if x < 0.0:
            return f * (1.0 + x / r)
        return f * max(grow, 0.0) * math.exp(-x / (3.0 * r))
    if P[AD] == 2.0:
        s = P[PW] / 2.0
        if leaving == 1 and turn > 0.0:
            e = r * min(1.0, max(0.0, (turn - x) / (0.2 * turn)))
            return f * ((x + e) / r) ** s if x + e > 0.0 else 0.0
        return f * (x / r) ** s if x > 0.0 else 0.0
    if P[AD] == 3.0:
        if x >= 0.0:
            return f
        if x > -r:
            return f * (1.0 + x / r) ** 2
    if P[AD] == 4.0 and leaving == 1 and turn > 0.0 and x > -r:
        grow = min(1.0, max(0.0, (turn - x) / (0.2 * turn)))
        return f * (grow * math.exp(-(x / (1.3 * r)) ** 2) if x > 0.0 else 1.0 / (1.0 - 3.0 * x / r) ** 2)
    return 0.0


@njit(cache=True)
def preload(x, P):
    """Force of a contact spring under preload at depth x [m] > 0, beside the power law [N]; no rate, nothing is lost.

    1 taken over linearly within a depth. 2 taken over as tanh. 3 as 2, and falling with depth towards a share left,
    as a disc spring or a buckled beam gives way (Almen and Laszlo 1936).
    """
    f = P[PRE_F]
    if P[PRE] == 1.0:
        return f * min(1.0, x / P[PRE_D])
    f *= math.tanh(x / P[PRE_D])
    if P[PRE] == 3.0:
        f *= 1.0 - P[PRE_SAG] * (1.0 - math.exp(-x / P[PRE_X]))
    return f


@njit(cache=True)
def contact_force(x, v, touching, leaving, deepest, turn, cracked, y, P):
    """Force between body and stop [N], positive in compression."""
    f = 0.0
    if touching == 1 and x > 0.0:
        s = skeleton(x, deepest, P)
        if P[WIG] != 0.0:
            w = 1.0
            for i in range(WIG_N):
                w += P[WIG + 3 * i] * math.sin(P[WIG + 3 * i + 1] * x + P[WIG + 3 * i + 2])
            s *= w
        if P[PLAT] != 0.0:
            s *= 1.0 - P[PLAT] / (1.0 + math.exp(-(x - P[PLAT_X]) / P[PLAT_W]))
        if RATE > 0 and P[RATE] != 0.0:
            s *= 1.0 + P[RATE] * math.log(1.0 + abs(v) / P[RATE_V])
        f = s
        if P[MU] != 0.0:
            mu = P[MU] * P[KFAC]
            if P[MU_THIN] > 0.0 and P[MU_POW] > 0.0:
                # Hunt and Crossley's general damping, with a slope left at rest
                mu *= (0.02 + abs(v) / P[MU_THIN]) ** (P[MU_POW] - 1.0)
            elif P[MU_THIN] > 0.0:
                mu /= 1.0 + abs(v) / P[MU_THIN]
            f += mu * x ** P[PW] * v
        if P[CQ] != 0.0:
            f += P[CQ] * x ** P[CQ_Q] * v
        if P[CV] != 0.0:
            c = P[CV]
            if P[CV_RAMP] > 0.0:
                q = min(1.0, x / P[CV_RAMP])
                c *= q * q * (3.0 - 2.0 * q)
            if P[CV_THIN] > 0.0 and P[CV_POW] > 0.0:
                # Ostwald and de Waele's power law, with a slope left at rest
                c *= (0.02 + abs(v) / P[CV_THIN]) ** (P[CV_POW] - 1.0)
            elif P[CV_THIN] > 0.0:
                c /= 1.0 + abs(v) / P[CV_THIN]
            f += c * v
        if P[ST_K] != 0.0 and P[ST_W] > 0.0:
            w, d = P[ST_W], P[ST_D]
            e = w * (math.log1p(math.exp((x - d) / w)) - math.log1p(math.exp(-d / w)))
            f += P[ST_K] * e ** P[ST_P]
        elif P[ST_K] != 0.0 and x > P[ST_D]:
            f += P[ST_K] * (x - P[ST_D]) ** P[ST_P]
        if P[ST2_K] != 0.0 and x > P[ST2_D]:
            f += P[ST2_K] * (x - P[ST2_D])
        if P[PRE] != 0.0:
            f += preload(x, P)
        if P[TH] != 0.0 and abs(v) > P[TH_V]:
            f += P[TH] * (abs(v) - P[TH_V]) * v * min(1.0, x / P[TH_D])
        if P[SKIN_F] != 0.0 and deepest < 1.1 * P[SKIN_D] and x < 1.1 * P[SKIN_D]:
            f += P[SKIN_F] * min(x / P[SKIN_D], 11.0 - 10.0 * x / P[SKIN_D])
        if P[LOSS] != 0.0:
            f += P[LOSS] * s * math.tanh(v / P[LOSS_V])
        if P[CORR_F] != 0.0:
            f += P[CORR_F] * math.sin(2.0 * math.pi * x / P[CORR_W]) * min(1.0, x / P[CORR_W])
        for i in range(int(P[VE_N])):
            f += y[7 + i]
        if cracked == 1:
            f *= 1.0 - P[CRACK_D]
        if f < 0.0:
            f = 0.0
    if P[AD] != 0.0:
        f -= pull(x, leaving, turn, P)
    return f


@njit(cache=True)
def friction(v, z, P):
    """Guide friction against the motion [N] and the bristle's speed [m/s].

    1 Coulomb, 2 Stribeck 1902 (Gaussian), 3 LuGre (Canudas de Wit and others 1995); each with a viscous part."""
    if P[FR] == 1.0:
        return P[FR_C] * math.tanh(v / 0.003) + P[FR_V] * v, 0.0
    g = P[FR_C] + (P[FR_S] - P[FR_C]) * math.exp(-(v / P[FR_VS]) ** 2)
    if P[FR] == 2.0:
        return g * math.tanh(v / 0.003) + P[FR_V] * v, 0.0
    dz = v - P[FR_SIG] * abs(v) / g * z
    damp = 0.3 * math.sqrt(P[FR_SIG] * P[M])
    return P[FR_SIG] * z + damp * math.exp(-(v / 0.02) ** 2) * dz + P[FR_V] * v, dz


@njit(cache=True)
def others(t, x, v, z, P):
    """Every force on the body but contact and loose part [N], and the bristle's speed."""
    f = P[M] * P[G] + P[SP_PRE] - P[SP_K] * (x + P[TRAVEL])
    dz = 0.0
    if P[SP_K2] != 0.0 and x > P[SP_X2]:
        f -= P[SP_K2] * (x - P[SP_X2])
    if P[SP_K3] != 0.0:
        f -= P[SP_K3] * (x + P[TRAVEL]) ** 3
    if P[FR] != 0.0:
        q, dz = friction(v, z, P)
        f -= q
    if P[DRAG] != 0.0:
        c = P[DRAG]
        if v < 0.0:
            c *= P[DRAG_BACK]
        if P[DRAG_CR] > 0.0:
            c *= 1.0 - 0.5 / (1.0 + math.exp(-10.0 * (abs(v) / P[DRAG_CR] - 1.0)))
        f -= c * (abs(v) ** (P[DRAG_N] - 1.0) + P[DRAG_LIN]) * v
    if P[SQ] != 0.0:
        gap = max(-x, 0.0)
        if P[SQ_CUT] == 0.0 or gap < P[SQ_CUT]:
            w = (P[SQ_G] / (gap + P[SQ_G])) ** P[SQ_N]
            if P[SQ_CUT] > 0.0:
                w *= 1.0 - gap / P[SQ_CUT]
            f -= P[SQ] * w * v
    if P[MG_F] != 0.0:
        m = P[MG_F]
        if P[MG_Z] > 0.0:
            m /= (1.0 + max(x + P[TRAVEL], 0.0) / P[MG_Z]) ** 2
        if P[MG_T] > 0.0:
            m *= 1.0 / (1.0 + t / P[MG_T]) ** 2 if P[MG_EDDY] > 0.0 else math.exp(-t / P[MG_T])
        f -= m
    if P[JAM] != 0.0:
        f -= P[JAM] * math.exp(-((x - P[JAM_X]) / P[JAM_W]) ** 2) * math.tanh(v / 0.003)
    if P[LA_F] != 0.0:
        f += P[LA_F] / (1.0 + max(-x, 0.0) / P[LA_Z]) ** 4
    if P[PAWL] != 0.0 and v < 0.0:
        f += P[PAWL] * math.tanh(-v / 0.003)
    if P[VIB] != 0.0:
        f += P[VIB] * math.sin(P[VIB_W] * t + P[VIB_PH])
    return f, dz


@njit(cache=True)
def loose_force(d, dd, P):
    """Force of the loose part on the body [N] at lead d [m] of the part and its rate."""
    e = d - P[LGAP]
    if e > 0.0:
        return max(0.0, P[LK] * e ** P[LP] + P[LC] * dd * min(1.0, e / (0.05 * P[LGAP] + 1e-12)))
    if P[LTWO] > 0.0 and d < -P[LTWO]:
        e = -P[LTWO] - d
        return -max(0.0, P[LK] * e ** P[LP] - P[LC] * dd)
    return 0.0


@njit(cache=True)
def riding_force(d, dd, P):
    """Force of the riding mass on the body [N] at lead d [m] of the mass and its rate dd [m/s]."""
    f = P[AM_C] * dd
    e = d
    if P[AM_GAP] > 0.0:
        e = d - P[AM_GAP] if d > P[AM_GAP] else d + P[AM_GAP] if d < -P[AM_GAP] else 0.0
    f += P[AM_K] * e + P[AM_K3] * e ** 3
    if P[AM_DRY] > 0.0:
        f += P[AM_DRY] * math.tanh(dd / CREEP)
    return f


@njit(cache=True)
def rhs(t, y, mode, mem, P, dy):
    """Time derivative of the state, and what the sensors stand on: contact force, transducer force, acceleration."""
    x, v = y[0], y[1]
    f, dz = others(t, x, v, y[6], P)
    xc, vc = x, v
    if P[BMODE] == 1.0:
        xc, vc = x - y[2], v - y[3]
    elif P[BMODE] == 2.0:
        xc, vc = y[2], y[3]
    fc = contact_force(xc, vc, mode[0], mode[1], mem[0], mem[1], mode[3], y, P)
    fl = 0.0
    if P[LM] > 0.0:
        fl = loose_force(y[4] - x, y[5] - v, P)
    if P[SIDE] != 0.0:
        f -= P[SIDE] * abs(fc) * math.tanh(v / 0.003)
    fa = riding_force(y[15] - x, y[16] - v, P) if P[AM] > 0.0 else 0.0
    reading = fc
    own = P[M] - P[LM] - P[AM]               # what moves with the accelerometer
    if P[BMODE] == 2.0:
        reading = P[KB] * (x - y[2]) + P[CB] * (v - y[3])
        own -= P[MB]
        a = (f - (P[M] - own) * P[G] - reading + fl + fa) / own
        dy[3] = (reading - fc) / P[MB] + P[G]
    else:
        a = (f - (P[M] - own) * P[G] - fc + fl + fa) / own
        dy[3] = 0.0
        if P[BMODE] == 1.0:
            dy[3] = (fc - P[KB] * y[2] - P[KB3] * y[2] ** 3 - P[CB] * y[3]
                     - P[CB_DRY] * math.tanh(y[3] / CREEP)) / P[MB]
    dy[0], dy[1], dy[2] = v, a, y[3]
    dy[4] = y[5]
    dy[5] = P[G] - fl / P[LM] if P[LM] > 0.0 else 0.0
    dy[6] = dz
    dy[15] = y[16]
    dy[16] = P[G] - fa / P[AM] if P[AM] > 0.0 else 0.0
    nb = int(P[VE_N])
    for i in range(nb):
        if mode[0] == 1 and xc > 0.0:
            w = vc
            if P[VE_KIND] == 1.0:
                w = P[PW] * xc ** (P[PW] - 1.0) * vc
            dy[7 + i] = P[VE_K + i] * w - y[7 + i] / P[VE_T + i]
        else:
            dy[7 + i] = -y[7 + i] / P[VE_T + i]
    return fc, reading, a


@njit(cache=True)
def events(y, P, g):
    """Functions whose zero ends a step: touch, turning, loose part, second layer, standstill of the body."""
    xc, vc = y[0], y[1]
    if P[BMODE] == 1.0:
        xc, vc = y[0] - y[2], y[1] - y[3]
    elif P[BMODE] == 2.0:
        xc, vc = y[2], y[3]
    g[0] = xc
    g[1] = vc
    g[2] = y[4] - y[0] - P[LGAP] if P[LM] > 0.0 else 1.0
    g[3] = xc - P[ST_D] if P[ST_K] != 0.0 else 1.0
    g[4] = y[1]
    g[5] = xc + P[AD_R] if P[AD] != 0.0 else 1.0


@njit(cache=True)
def step(t, y, h, n, mode, mem, P, k, out, err):
    """One Dormand-Prince step; k[0] holds the derivative at t. Leaves the derivative at t+h in k[6]."""
    w = np.empty(NS)
    for i in range(n):
        w[i] = y[i] + h * k[0, i] / 5.0
    rhs(t + h / 5.0, w, mode, mem, P, k[1])
    for i in range(n):
        w[i] = y[i] + h * (3.0 / 40.0 * k[0, i] + 9.0 / 40.0 * k[1, i])
    rhs(t + 0.3 * h, w, mode, mem, P, k[2])
    for i in range(n):
        w[i] = y[i] + h * (44.0 / 45.0 * k[0, i] - 56.0 / 15.0 * k[1, i] + 32.0 / 9.0 * k[2, i])
    rhs(t + 0.8 * h, w, mode, mem, P, k[3])
    for i in range(n):
        w[i] = y[i] + h * (19372.0 / 6561.0 * k[0, i] - 25360.0 / 2187.0 * k[1, i] + 64448.0 / 6561.0 * k[2, i]
                           - 212.0 / 729.0 * k[3, i])
    rhs(t + 8.0 / 9.0 * h, w, mode, mem, P, k[4])
    for i in range(n):
        w[i] = y[i] + h * (9017.0 / 3168.0 * k[0, i] - 355.0 / 33.0 * k[1, i] + 46732.0 / 5247.0 * k[2, i]
                           + 49.0 / 176.0 * k[3, i] - 5103.0 / 18656.0 * k[4, i])
    rhs(t + h, w, mode, mem, P, k[5])
    for i in range(n):
        out[i] = y[i] + h * (35.0 / 384.0 * k[0, i] + 500.0 / 1113.0 * k[2, i] + 125.0 / 192.0 * k[3, i]
                             - 2187.0 / 6784.0 * k[4, i] + 11.0 / 84.0 * k[5, i])
    rhs(t + h, out, mode, mem, P, k[6])
    for i in range(n):
        err[i] = h * (71.0 / 57600.0 * k[0, i] - 71.0 / 16695.0 * k[2, i] + 71.0 / 1920.0 * k[3, i]
                      - 17253.0 / 339200.0 * k[4, i] + 22.0 / 525.0 * k[5, i] - 1.0 / 40.0 * k[6, i])


@njit(cache=True)
def active(P):
    """How many entries of the state are in use."""
    if P[AM] > 0.0:
        return NS
    if P[VE_N] > 0.0:
        return 7 + int(P[VE_N])
    if P[FR] == 3.0:
        return 7
    if P[LM] > 0.0:
        return 6
    if P[BMODE] > 0.0:
        return 4
    return 2


@njit(cache=True)
def run(P, x0, v0, times, scale_x, scale_v, tol, out):
    """Integrates from (x0, v0) at t = 0 through the increasing `times` [s]; rows before t = 0 stand at the start.

    out[i] = x, v, acceleration, contact force, transducer force, touching (0/1), leaving (0/1).
    Returns time and speed of the first touch (nan without), and the number of steps.
    """
    n = active(P)
    y, w, err = np.zeros(NS), np.zeros(NS), np.zeros(NS)
    y[0], y[1], y[4], y[5], y[15], y[16] = x0, v0, x0, v0, x0, v0
    if P[BMODE] == 2.0:
        y[2], y[3] = x0, v0
    k = np.zeros((7, NS))
    mode = np.zeros(4, np.int64)      # touching, leaving, -, cracked
    mem = np.zeros(2)                 # deepest indentation, turning depth of this contact
    ne = 6
    g, g1, s = np.zeros(ne), np.zeros(ne), np.zeros(ne)
    events(y, P, g)
    for i in range(ne):
        s[i] = 1.0 if g[i] > 0.0 else -1.0
    s[1] = 1.0 if v0 >= 0.0 else -1.0
    s[4] = s[1]
    mode[0] = 1 if g[0] > 0.0 else 0
    sc = np.empty(NS)
    fs = P[M] * scale_v * scale_v / scale_x
    for i in range(NS):
        sc[i] = scale_x if i % 2 == 0 else scale_v
    sc[6] = scale_x * 0.05
    for i in range(7, VE_END):
        sc[i] = fs
    sc[15], sc[16] = scale_x, scale_v
    t = 0.0
    t_touch, v_touch = np.nan, np.nan
    rhs(t, y, mode, mem, P, k[0])
    h = (times[-1] - times[0]) / len(times)
    hmax = 20.0 * h
    steps = 0
    for j in range(len(times)):
        while t < times[j]:
            steps += 1
            if steps > 400000:
                return np.nan, np.nan, -1
            left = times[j] - t
            hh = min(h, hmax)
            last = False
            if hh >= left * (1.0 - 1e-12):
                hh = left
                last = True
            elif hh > 0.5 * left:
                hh = 0.5 * left
            step(t, y, hh, n, mode, mem, P, k, w, err)
            e = 0.0
            for i in range(n):
                e = max(e, abs(err[i]) / (tol * (sc[i] + abs(y[i]) * 0.1)))
            if not e < 1e30:
                return np.nan, np.nan, -1
            if e > 1.0 and hh > 1e-13:
                h = hh * max(0.2, 0.9 * e ** -0.2)
                continue
            # an event inside? the earliest one, by bisected re-steps (Illinois)
            events(w, P, g1)
            hit = -1
            hbest = hh
            for i in range(ne):
                if i == 1 and s[0] < 0.0 and P[AD] == 0.0:
                    continue
                if g1[i] * s[i] < 0.0:
                    a, b = 0.0, hbest
                    events(y, P, g)
                    ga = g[i] * s[i]
                    gb = g1[i] * s[i]
                    if hit >= 0:
                        step(t, y, b, n, mode, mem, P, k, w, err)
                        events(w, P, g)
                        gb = g[i] * s[i]
                        if gb >= 0.0:
                            continue
                    if ga <= 0.0:
                        ga = 1e-300
                    side = 0
                    hm = b
                    for _ in range(60):
                        hm = (a * gb - b * ga) / (gb - ga)
                        if not (hm > a and hm < b):
                            hm = 0.5 * (a + b)
                        step(t, y, hm, n, mode, mem, P, k, w, err)
                        events(w, P, g)
                        gm = g[i] * s[i]
                        if gm > 0.0:
                            a, ga = hm, gm
                            if side == 1:
                                gb *= 0.5
                            side = 1
                        else:
                            b, gb = hm, gm
                            if side == -1:
                                ga *= 0.5
                            side = -1
                        if b - a < 1e-15 + 1e-13 * hh or gm == 0.0:
                            break
                    hit, hbest = i, b
            if hit >= 0:
                hh = hbest
                last = False
                step(t, y, hh, n, mode, mem, P, k, w, err)
            t = times[j] if last else t + hh
            for i in range(n):
                y[i] = w[i]
            if n <= 4:
                y[4], y[5] = y[0], y[1]
            events(y, P, g)
            if mode[0] == 1 and g[0] > mem[0] and mode[1] == 0:
                mem[0] = g[0]
            if hit >= 0:
                s[hit] = -s[hit]
                if hit == 0:
                    mode[0] = 1 if s[0] > 0.0 else 0
                    if s[0] > 0.0:
                        mode[1] = 0
                        mem[1] = 0.0
                        if not t_touch == t_touch:
                            t_touch, v_touch = t, g[1]
                        s[1] = 1.0 if g[1] > 0.0 else -1.0
                    else:
                        for i in range(7, VE_END):
                            y[i] = 0.0
                if hit == 1 and mode[0] == 1:
                    if s[1] < 0.0:
                        mode[1] = 1
                        mem[1] = max(g[0], mem[1])
                        mem[0] = max(mem[0], g[0])
                    else:
                        mode[1] = 0
                if hit == 5 and s[5] < 0.0:
                    mode[1] = 0
            fc = rhs(t, y, mode, mem, P, k[0])[0]
            if P[CRACK_F] > 0.0 and mode[3] == 0 and fc > P[CRACK_F]:
                mode[3] = 1
                rhs(t, y, mode, mem, P, k[0])
            grow = 5.0 if e < 1e-6 else min(5.0, 0.9 * e ** -0.2)
            if hit < 0:
                h = max(hh, h if last else 0.0) * max(grow, 0.2) if not last else max(h, hh * max(grow, 0.2))
            else:
                h = max(h, hh)
        fc, fr, a = rhs(times[j], y, mode, mem, P, k[0])
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4] = y[0], y[1], a, fc, fr
        out[j, 5], out[j, 6] = mode[0], mode[1]
        if times[j] < 0.0:
            out[j, 2] = 0.0
    return t_touch, v_touch, steps


@njit(cache=True)
def imposed(P, times, x, v, out):
    """Indentation: the path x(t) is imposed, the law answers; columns as in `run`. Branches by exact exponentials."""
    y = np.zeros(NS)
    deepest, turn = 0.0, 0.0
    leaving, cracked = 0, 0
    nb = int(P[VE_N])
    for j in range(len(times)):
        touching = 1 if x[j] > 0.0 else 0
        if touching == 1:
            if v[j] > 0.0:
                leaving = 0
            elif v[j] < 0.0 and leaving == 0:
                leaving, turn = 1, max(turn, x[j])
            turn = max(turn, x[j])
            deepest = max(deepest, x[j])
        elif P[AD] == 0.0 or x[j] < -P[AD_R]:
            leaving = 0
        if j > 0 and nb > 0:
            dt = times[j] - times[j - 1]
            a, b = max(x[j - 1], 0.0), max(x[j], 0.0)
            if P[VE_KIND] == 1.0:
                a, b = a ** P[PW], b ** P[PW]
            for i in range(nb):
                q = dt / P[VE_T + i]
                e = math.exp(-q)
                y[7 + i] = y[7 + i] * e + P[VE_K + i] * (b - a) * ((1.0 - e) / q)
                if touching == 0:
                    y[7 + i] = 0.0
        fc = contact_force(x[j], v[j], touching, leaving, deepest, turn, cracked, y, P)
        if P[CRACK_F] > 0.0 and cracked == 0 and fc > P[CRACK_F]:
            cracked = 1
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4] = x[j], v[j], 0.0, fc, fc
        out[j, 5], out[j, 6] = touching, leaving
