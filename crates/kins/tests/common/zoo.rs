//! Every mechanism with a box of poses and the travel of its joints, and a small generator that prefers trouble.

use pkm_kins::maths::radians;
use pkm_kins::*;

/// xorshift64*: small, the same everywhere.
pub struct Rng(u64);

impl Rng {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }
}

/// How many random poses per mechanism: 100,000, scaled by PKM_TEST_SCALE.
pub fn count() -> usize {
    let scale: f64 = std::env::var("PKM_TEST_SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    (100_000.0 * scale).max(100.0) as usize
}

/// PKM_TEST_SEED, else a fixed one.
pub fn seed() -> u64 {
    std::env::var("PKM_TEST_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(20_260_721)
}

type Mirror = fn(&Pose, &Joints) -> (Pose, Joints);

pub struct Case {
    pub name: &'static str,
    pub mechanism: Mechanism,
    /// Box of poses, letter order; it contains reachable poses and most of the time unreachable ones.
    pub low: [f64; 9],
    pub high: [f64; 9],
    /// Travel.
    pub travel: Vec<[f64; 2]>,
    /// Lengths of this order, mm: rounding is relative to it.
    pub size_mm: f64,
    /// A symmetry: pose and joints of the mirror image.
    pub mirror: Option<Mirror>,
}

impl Case {
    pub fn pose(&self, rng: &mut Rng) -> Pose {
        let mut all = [0.0; 9];
        for ((value, low), high) in all.iter_mut().zip(self.low).zip(self.high) {
            *value = rng.between(low, high);
        }
        Pose::from_array(all)
    }

    /// A pose at or near the edge of reach: bisected between a reachable and an unreachable one, then back by 10^-k.
    pub fn edge_pose(&self, rng: &mut Rng) -> Option<Pose> {
        let (mut inside, mut outside) = (None, None);
        for _ in 0..10 {
            let pose = self.pose(rng);
            if self.mechanism.inverse(&pose).is_ok() {
                inside = Some(pose)
            } else {
                outside = Some(pose)
            }
            if inside.is_some() && outside.is_some() {
                break;
            }
        }
        let (mut inside, mut outside) = (inside?, outside?);
        let centre = inside;
        for _ in 0..rng.between(20.0, 60.0) as usize {
            let middle = blend(&inside, &outside, 0.5);
            if self.mechanism.inverse(&middle).is_ok() { inside = middle } else { outside = middle }
        }
        let back = rng.between(-14.0, -2.0);
        let back = if back < -13.0 { 0.0 } else { pkm_kins::maths::pow(10.0, back) };
        Some(blend(&inside, &centre, back))
    }

    /// A pose whose joints stand at the ends of their travel, or an ulp beside.
    pub fn limit_pose(&self, rng: &mut Rng) -> Option<Pose> {
        let mut joints = [0.0; MAX_JOINTS];
        for (joint, [low, high]) in joints.iter_mut().zip(&self.travel) {
            *joint = match rng.below(6) {
                0 => *low,
                1 => *high,
                2 => low.next_up(),
                3 => high.next_down(),
                _ => rng.between(*low, *high),
            };
        }
        self.mechanism.forward(&joints, &self.centre()).ok()
    }

    pub fn centre(&self) -> Pose {
        blend(&Pose::from_array(self.low), &Pose::from_array(self.high), 0.5)
    }

    /// Half of the poses anywhere in the box, half of them trouble.
    pub fn any_pose(&self, rng: &mut Rng) -> Pose {
        let trouble = match rng.below(4) {
            0 => self.edge_pose(rng),
            1 => self.limit_pose(rng),
            _ => None,
        };
        trouble.unwrap_or_else(|| self.pose(rng))
    }
}

fn blend(a: &Pose, b: &Pose, t: f64) -> Pose {
    let mut all = a.to_array();
    for (x, y) in all.iter_mut().zip(b.to_array()) {
        *x += t * (y - *x);
    }
    Pose::from_array(all)
}

fn swap_x(p: &Pose, q: &Joints) -> (Pose, Joints) {
    let mut joints = *q;
    joints.swap(0, 1);
    (Pose { x: -p.x, ..*p }, joints)
}

fn swap_xy(p: &Pose, q: &Joints) -> (Pose, Joints) {
    let mut joints = *q;
    joints.swap(0, 1);
    (Pose { x: p.y, y: p.x, ..*p }, joints)
}

fn swap_wire(p: &Pose, q: &Joints) -> (Pose, Joints) {
    let mut joints = *q;
    joints.swap(0, 1);
    joints.swap(2, 3);
    (Pose { x: -p.x, u: -p.u, ..*p }, joints)
}

/// Mirror in the plane through the table's axis: B (or C and the head's B) change sign.
fn swap_mill(p: &Pose, q: &Joints) -> (Pose, Joints) {
    let mut joints = *q;
    joints.swap(0, 1);
    joints[3] = -q[3];
    joints[4] = -q[4];
    (Pose { x: -p.x, b: -p.b, c: -p.c, ..*p }, joints)
}

fn swap_rail(p: &Pose, q: &Joints) -> (Pose, Joints) {
    let mut joints = *q;
    joints[0] = 130.0 - q[1];
    joints[1] = 130.0 - q[0];
    (Pose { x: 130.0 - p.x, ..*p }, joints)
}

/// [L6]'s symmetry about X (δ = 0): mirror y, so ψ and φ change sign and legs 2, 3 change places.
fn swap_lambda(p: &Pose, q: &Joints) -> (Pose, Joints) {
    let mut joints = *q;
    joints.swap(1, 2);
    joints.swap(4, 5);
    (Pose { y: -p.y, a: -p.a, c: -p.c, ..*p }, joints)
}

fn swap_delta(p: &Pose, q: &Joints) -> (Pose, Joints) {
    let mut joints = *q;
    joints.swap(1, 2);
    (Pose { x: -p.x, ..*p }, joints)
}

/// Mirror y: strut 0 (pair 0, left) and 1 (pair 0, right) change places, and pairs 1 and 2.
fn swap_hexapod(p: &Pose, q: &Joints) -> (Pose, Joints) {
    let mut joints = [0.0; MAX_JOINTS];
    joints[..6].copy_from_slice(&[q[1], q[0], q[5], q[4], q[3], q[2]]);
    (Pose { y: -p.y, a: -p.a, c: -p.c, ..*p }, joints)
}

fn planar_case(
    name: &'static str,
    mechanism: Mechanism,
    (low, high): ([f64; 2], [f64; 2]),
    mirror: Option<Mirror>,
) -> Case {
    let full = |[x, y]: [f64; 2]| [x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let travel = vec![[0.0, 200.0]; 2];
    Case { name, mechanism, low: full(low), high: full(high), travel, size_mm: 200.0, mirror }
}

/// Every kind of mechanism, in all configurations.
pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    let boxes = [
        ([-130.0, -420.0], [130.0, -100.0]),
        ([-130.0, -420.0], [130.0, -100.0]),
        ([100.0, 100.0], [210.0, 210.0]),
        ([-100.0, -100.0], [210.0, 210.0]),
    ];
    for ((name, configuration), (low, high)) in
        ["moma-a", "moma-b", "moma-c", "moma-d"].into_iter().zip(MomaConfiguration::ALL).zip(boxes)
    {
        let mirror: Mirror = if name < "moma-c" { swap_x } else { swap_xy };
        let moma = Moma::new(&configuration.into()).unwrap();
        all.push(planar_case(name, moma.into(), (low, high), Some(mirror)));
    }
    let one_sided = MomaParameters { one_sided: true, ..MomaConfiguration::B.into() };
    all.push(planar_case("moma-b one-sided", Moma::new(&one_sided).unwrap().into(), boxes[0], Some(swap_x)));
    for (name, configuration) in ["moma-4s-p", "moma-4s-s5", "moma-4s-s10", "moma-4s-u5", "moma-4s-u10"]
        .into_iter()
        .zip(Moma4sConfiguration::ALL)
    {
        let machine = Moma4s::new(&configuration.into()).unwrap();
        all.push(planar_case(name, machine.into(), ([-160.0, -420.0], [160.0, -130.0]), Some(swap_x)));
    }
    let general = PlanarParameters {
        reference_mm: [[-130.47, 27.89], [55.06, 39.76]],
        guide_angle_deg: [329.21, 199.63],
        l_mm: [154.16, 153.59],
        offset_mm: [[-7.22, 1.66], [18.16, 11.04]],
        working_mode: [-1, 1],
        assembly: 1,
        one_sided: false,
    };
    let planar = Planar::new(&general).unwrap();
    all.push(planar_case("planar", planar.into(), ([-60.0, -180.0], [180.0, 60.0]), None));

    all.push(Case {
        name: "moma-w",
        mechanism: MomaW::new(&MomaWParameters::default()).unwrap().into(),
        low: [-110.0, -70.0, -110.0, 0.0, 0.0, 0.0, -110.0, -70.0, 0.0],
        high: [110.0, 70.0, 210.0, 0.0, 0.0, 0.0, 110.0, 70.0, 0.0],
        travel: vec![[0.0, 200.0], [0.0, 200.0], [0.0, 200.0], [0.0, 200.0], [0.0, 100.0]],
        size_mm: 500.0,
        mirror: Some(swap_wire),
    });
    let limited = MomaWParameters {
        max_wire_length_mm: Some(505.0),
        max_wire_tilt_deg: Some(6.0),
        ..MomaWParameters::default()
    };
    let w = all.last().unwrap();
    all.push(Case {
        name: "moma-w limited",
        mechanism: MomaW::new(&limited).unwrap().into(),
        travel: w.travel.clone(),
        ..*w
    });

    let turn = radians(180.0);
    let tilt = radians(45.0);
    for (name, parameters, [b, c]) in [
        ("hv-mill-h3", HvMillParameters::h(3), [0.0, 0.0]),
        ("hv-mill-h4", HvMillParameters::h(4), [tilt, 0.0]),
        ("hv-mill-v3", HvMillParameters::v(3), [0.0, 0.0]),
        ("hv-mill-v4", HvMillParameters::v(4), [0.0, turn]),
        ("hv-mill-v5", HvMillParameters::v(5), [tilt, turn]),
    ] {
        let range = |angle: f64| [-angle, angle];
        let rotary =
            if parameters.spindle == Spindle::H { [range(b), [0.0; 2]] } else { [range(c), range(b)] };
        all.push(Case {
            name,
            mechanism: HvMill::new(&parameters).unwrap().into(),
            low: [-120.0, -150.0, -100.0, 0.0, -b, -c, 0.0, 0.0, 0.0],
            high: [120.0, 150.0, 150.0, 0.0, b, c, 0.0, 0.0, 0.0],
            travel: vec![[0.0, 200.0], [0.0, 200.0], [0.0, 400.0], rotary[0], rotary[1]],
            size_mm: 700.0,
            mirror: Some(swap_mill),
        });
    }
    let machine = HvMachine::new(&HvMachineParameters::seven()).unwrap();
    let travel =
        vec![[0.0, 200.0], [0.0, 200.0], [0.0, 200.0], [0.0, 200.0], [0.0, 400.0], [-tilt, tilt], [0.0, 0.0]];
    all.push(Case {
        name: "hv-mill-7 (H)",
        mechanism: machine.into(),
        low: [-120.0, -150.0, -100.0, 0.0, -tilt, 0.0, 0.0, 0.0, 0.0],
        high: [120.0, 150.0, 150.0, 0.0, tilt, 0.0, 0.0, 0.0, 0.0],
        travel: travel.clone(),
        size_mm: 700.0,
        mirror: None,
    });
    let start = machine.inverse(&Pose::ZERO).unwrap();
    let (vertical, _) = machine.switch(Spindle::V, &start, &Pose::ZERO).unwrap();
    all.push(Case {
        name: "hv-mill-7 (V)",
        mechanism: vertical.into(),
        low: [0.0, 0.0, 0.0, 0.0, -tilt, -turn, -120.0, -150.0, -100.0],
        high: [0.0, 0.0, 0.0, 0.0, tilt, turn, 120.0, 150.0, 150.0],
        travel,
        size_mm: 700.0,
        mirror: None,
    });

    for (name, form) in [("ox-glide-o", OxForm::O), ("ox-glide-x", OxForm::X)] {
        all.push(Case {
            name,
            mechanism: OxGlide::new(&form.into()).unwrap().into(),
            low: [0.0, -10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            high: [130.0, 85.0, 200.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            travel: vec![[0.0, 130.0], [0.0, 130.0], [0.0, 200.0]],
            size_mm: 130.0,
            mirror: Some(swap_rail),
        });
    }

    for (name, set) in ["lambda6-paper", "lambda6", "lambda6 asym45", "lambda6 alt45", "lambda6 wide"]
        .into_iter()
        .zip(Lambda6Set::ALL)
    {
        let z = if name == "lambda6 alt45" { -1200.0 } else { -1500.0 };
        let angle = radians(30.0);
        all.push(Case {
            name,
            mechanism: Lambda6::new(&set.into()).unwrap().into(),
            low: [-500.0, -500.0, z - 300.0, -angle, -angle, -angle, 0.0, 0.0, 0.0],
            high: [500.0, 500.0, z + 300.0, angle, angle, angle, 0.0, 0.0, 0.0],
            travel: [[[100.0, 800.0]; 3], [[1200.0, 2000.0]; 3]].concat(),
            size_mm: 2000.0,
            mirror: (name == "lambda6-paper" || name == "lambda6 wide").then_some(swap_lambda),
        });
    }

    let delta = LinearDeltaParameters { joint_radius_mm: 140.0, joint_length_mm: 270.0 };
    all.push(Case {
        name: "linear delta",
        mechanism: LinearDelta::new(&delta).unwrap().into(),
        low: [-250.0, -250.0, -100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        high: [250.0, 250.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        travel: vec![[0.0, 300.0]; 3],
        size_mm: 300.0,
        mirror: Some(swap_delta),
    });
    let hexapod = HexapodParameters::symmetric(300.0, radians(20.0), 150.0, radians(20.0), 400.0);
    let angle = radians(35.0);
    all.push(Case {
        name: "hexapod",
        mechanism: Hexapod::new(&hexapod).unwrap().into(),
        low: [-150.0, -150.0, 300.0, -angle, -angle, -angle, 0.0, 0.0, 0.0],
        high: [150.0, 150.0, 500.0, angle, angle, angle, 0.0, 0.0, 0.0],
        travel: vec![[350.0, 550.0]; 6],
        size_mm: 500.0,
        mirror: Some(swap_hexapod),
    });
    all.push(Case {
        name: "xyzabc",
        mechanism: Cartesian::new(AxisSet::new(&Axis::ALL)).unwrap().into(),
        low: [-500.0; 9],
        high: [500.0; 9],
        travel: vec![[-500.0, 500.0]; 9],
        size_mm: 500.0,
        mirror: None,
    });
    all
}
