//! Units that are taken for others, by the factor that each makes of a ratio.

use super::ratio::Slip;

/// Of force over mass times acceleration.
pub const FORCE_OVER_MA: [Slip; 10] = [
    Slip { factor: 1.0 / 4.448_221_6, words: "a factor of 4.448: force looks like lbf" },
    Slip { factor: 4.448_221_6, words: "a factor of 4.448: force looks like N that is called lbf" },
    Slip {
        factor: 1.0 / 9.80665,
        words: "a factor of 9.807: force looks like kgf, or acceleration like m/s^2 called g",
    },
    Slip { factor: 9.80665, words: "a factor of 9.807: acceleration looks like g, or force like N called kgf" },
    Slip { factor: 1e-3, words: "a factor of 1000: force looks like kN, or moving_mass like g" },
    Slip {
        factor: 1e3,
        words: "a factor of 1000: acceleration looks like km/s^2, force like mN or moving_mass like t",
    },
    Slip { factor: 0.1, words: "a factor of 10: force looks like daN" },
    Slip { factor: 10.0, words: "a factor of 10: force looks like N called daN" },
    Slip { factor: 1.0 / 2.204_622_6, words: "a factor of 2.205: moving_mass looks like lb" },
    Slip { factor: 2.204_622_6, words: "a factor of 2.205: moving_mass looks like kg that was taken for lb" },
];

const HEIGHT_IN_MM: Slip =
    Slip { factor: 1.0 / 31.6228, words: "a factor of 31.6, the root of 1000: drop_height looks like mm" };
const TIME_IN_MS: Slip = Slip { factor: 1e3, words: "a factor of 1000: time looks like ms" };
const TIME_IN_US: Slip = Slip { factor: 1e6, words: "a factor of a million: time looks like us" };

/// Of the push over mass times the speed of impact, by the force.
pub const FORCE_OVER_SPEED: [Slip; 7] = [
    HEIGHT_IN_MM,
    Slip {
        factor: 1e-3,
        words: "a factor of 1000: the speed looks like mm/s, moving_mass like g or the force like kN",
    },
    TIME_IN_MS,
    TIME_IN_US,
    Slip { factor: 1.0 / 4.448_221_6, words: "a factor of 4.448: force looks like lbf" },
    Slip {
        factor: 1.0 / 9.80665,
        words: "a factor of 9.807: the force looks like kgf, or nothing stops the body as a drop test does",
    },
    Slip { factor: 9.80665, words: "a factor of 9.807: the force looks like N called kgf" },
];

/// The same by the acceleration, of which no mass is asked.
pub const ACCELERATION_OVER_SPEED: [Slip; 6] = [
    HEIGHT_IN_MM,
    Slip { factor: 1e-3, words: "a factor of 1000: the speed looks like mm/s" },
    TIME_IN_MS,
    TIME_IN_US,
    Slip {
        factor: 1.0 / 9.80665,
        words: "a factor of 9.807: the acceleration looks like g, or nothing stops the body as a drop test does",
    },
    Slip { factor: 9.80665, words: "a factor of 9.807: the acceleration looks like m/s^2 called g" },
];

/// Of the speed of the penetration over the speed given.
pub const WAY_OVER_SPEED: [Slip; 7] = [
    Slip { factor: 1e3, words: "a factor of 1000: penetration looks like mm, or the speed like km/h or mm/s" },
    Slip { factor: 1e-3, words: "a factor of 1000: the speed looks like mm/s, or time like ms" },
    Slip { factor: 25.4, words: "a factor of 25.4: penetration looks like mm called in" },
    Slip { factor: 1.0 / 25.4, words: "a factor of 25.4: penetration looks like in called mm" },
    HEIGHT_IN_MM,
    Slip { factor: 10.0, words: "a factor of 10: penetration looks like cm called mm" },
    Slip { factor: 0.1, words: "a factor of 10: penetration looks like mm called cm" },
];

/// Of the speed of impact over that of a free fall.
pub const SPEED_OVER_FALL: [Slip; 5] = [
    HEIGHT_IN_MM,
    Slip { factor: 0.1, words: "a factor of 10, the root of 100: drop_height looks like cm" },
    Slip { factor: 1e3, words: "a factor of 1000: impact_speed looks like mm/s" },
    Slip { factor: 3.6, words: "a factor of 3.6: impact_speed looks like km/h" },
    Slip { factor: 1.0 / 5.0395, words: "a factor of 5.04, the root of 25.4: drop_height looks like inches" },
];

/// Of the way from the first sample to the stop over travel.
pub const WAY_OVER_TRAVEL: [Slip; 4] = [
    Slip { factor: 1e3, words: "a factor of 1000: penetration looks like mm" },
    Slip { factor: 1e-3, words: "a factor of 1000: travel looks like mm" },
    Slip { factor: 25.4, words: "a factor of 25.4: penetration looks like mm called in" },
    Slip { factor: 1.0 / 25.4, words: "a factor of 25.4: penetration looks like in called mm" },
];
