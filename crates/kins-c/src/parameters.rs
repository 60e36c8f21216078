//! Parameters of every mechanism as C structures. Lengths mm, angles degrees; keys as in machine files.

use pkm_kins::{
    HeadParameters, HexapodParameters, HvMachineParameters, HvMillParameters, HvSideParameters,
    Lambda6Parameters, Lambda6Set, LinearDeltaParameters, Moma4sConfiguration, Moma4sParameters,
    MomaConfiguration, MomaParameters, MomaWParameters, OxForm, OxGlideParameters, PlanarParameters, Spindle,
};

/// A general planar mechanism: two sliders, two links, platform joints offset from the controlled point.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmPlanar {
    pub reference_mm: [[f64; 2]; 2],
    pub guide_angle_deg: [f64; 2],
    pub l_mm: [f64; 2],
    pub offset_mm: [[f64; 2]; 2],
    pub working_mode: [i8; 2],
    pub assembly: i8,
    pub one_sided: bool,
}

impl From<&PkmPlanar> for PlanarParameters {
    fn from(p: &PkmPlanar) -> Self {
        Self {
            reference_mm: p.reference_mm,
            guide_angle_deg: p.guide_angle_deg,
            l_mm: p.l_mm,
            offset_mm: p.offset_mm,
            working_mode: p.working_mode,
            assembly: p.assembly,
            one_sided: p.one_sided,
        }
    }
}

/// MOMA.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmMoma {
    pub reference_mm: [[f64; 2]; 2],
    pub guide_angle_deg: [f64; 2],
    pub l_mm: [f64; 2],
    pub working_mode: [i8; 2],
    pub assembly: i8,
    pub one_sided: bool,
}

impl From<&PkmMoma> for MomaParameters {
    fn from(p: &PkmMoma) -> Self {
        Self {
            reference_mm: p.reference_mm,
            guide_angle_deg: p.guide_angle_deg,
            l_mm: p.l_mm,
            working_mode: p.working_mode,
            assembly: p.assembly,
            one_sided: p.one_sided,
        }
    }
}

impl PkmMoma {
    /// Configurations `'a'` to `'d'`.
    pub(crate) fn named(name: u8) -> Option<Self> {
        let p = MomaParameters::from(match name {
            b'a' => MomaConfiguration::A,
            b'b' => MomaConfiguration::B,
            b'c' => MomaConfiguration::C,
            b'd' => MomaConfiguration::D,
            _ => return None,
        });
        Some(Self {
            reference_mm: p.reference_mm,
            guide_angle_deg: p.guide_angle_deg,
            l_mm: p.l_mm,
            working_mode: p.working_mode,
            assembly: p.assembly,
            one_sided: p.one_sided,
        })
    }
}

/// MOMA 4S.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmMoma4s {
    pub pivot_mm: [[f64; 2]; 2],
    pub rho_mm: [[f64; 2]; 2],
    pub gamma_deg: [f64; 2],
    pub l_mm: [f64; 2],
    pub l_h_mm: [f64; 2],
    pub l_t_mm: f64,
    pub alpha_t_deg: f64,
    pub working_mode: [i8; 2],
    pub assembly: i8,
    pub one_sided: bool,
}

impl From<&PkmMoma4s> for Moma4sParameters {
    fn from(p: &PkmMoma4s) -> Self {
        Self {
            pivot_mm: p.pivot_mm,
            rho_mm: p.rho_mm,
            gamma_deg: p.gamma_deg,
            l_mm: p.l_mm,
            l_h_mm: p.l_h_mm,
            l_t_mm: p.l_t_mm,
            alpha_t_deg: p.alpha_t_deg,
            working_mode: p.working_mode,
            assembly: p.assembly,
            one_sided: p.one_sided,
        }
    }
}

impl From<Moma4sParameters> for PkmMoma4s {
    fn from(p: Moma4sParameters) -> Self {
        Self {
            pivot_mm: p.pivot_mm,
            rho_mm: p.rho_mm,
            gamma_deg: p.gamma_deg,
            l_mm: p.l_mm,
            l_h_mm: p.l_h_mm,
            l_t_mm: p.l_t_mm,
            alpha_t_deg: p.alpha_t_deg,
            working_mode: p.working_mode,
            assembly: p.assembly,
            one_sided: p.one_sided,
        }
    }
}

impl PkmMoma4s {
    /// 0 for P, 5 and 10 for S5 and S10, −5 and −10 for U5 and U10.
    pub(crate) fn named(outward_deg: i32) -> Option<Self> {
        let configuration = match outward_deg {
            0 => Moma4sConfiguration::P,
            5 => Moma4sConfiguration::S5,
            10 => Moma4sConfiguration::S10,
            -5 => Moma4sConfiguration::U5,
            -10 => Moma4sConfiguration::U10,
            _ => return None,
        };
        Some(Moma4sParameters::from(configuration).into())
    }
}

/// MOMA-W. A wire limit of 0 is none.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmMomaW {
    pub mechanism: [PkmMoma4s; 2],
    pub b_mm: [f64; 3],
    pub w_mm: [f64; 3],
    pub contour_distance_mm: f64,
    pub max_wire_length_mm: f64,
    pub max_wire_tilt_deg: f64,
}

/// A limit, where 0 means none.
fn limit(value: f64) -> Option<f64> {
    if value == 0.0 { None } else { Some(value) }
}

impl From<&PkmMomaW> for MomaWParameters {
    fn from(p: &PkmMomaW) -> Self {
        let [first, second] = &p.mechanism;
        Self {
            mechanism: [first.into(), second.into()],
            b_mm: p.b_mm,
            w_mm: p.w_mm,
            contour_distance_mm: p.contour_distance_mm,
            max_wire_length_mm: limit(p.max_wire_length_mm),
            max_wire_tilt_deg: limit(p.max_wire_tilt_deg),
        }
    }
}

impl Default for PkmMomaW {
    fn default() -> Self {
        let p = MomaWParameters::default();
        let [first, second] = p.mechanism;
        Self {
            mechanism: [first.into(), second.into()],
            b_mm: p.b_mm,
            w_mm: p.w_mm,
            contour_distance_mm: p.contour_distance_mm,
            max_wire_length_mm: 0.0,
            max_wire_tilt_deg: 0.0,
        }
    }
}

/// The HV-Mill with both mechanisms. Array entry 0 is H, 1 is V.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmHvMachine {
    pub mechanism: [PkmMoma4s; 2],
    pub cr_mm: [[f64; 3]; 2],
    pub w0_mm: [[f64; 3]; 2],
    pub table_sense: [i8; 2],
    pub rest_mm: [[f64; 2]; 2],
    /// Seven joints (fig 2b) with a tilting head, else six (fig 2a).
    pub has_head: bool,
    pub head_c_mm: [f64; 3],
    pub head_sense: i8,
    /// `'H'` or `'V'`: active at start.
    pub active: u8,
}

impl PkmHvMachine {
    /// The parameters; `None` if `active` is neither `'H'` nor `'V'`.
    pub(crate) fn checked(&self) -> Option<HvMachineParameters> {
        let ([mh, mv], [ch, cv]) = (&self.mechanism, self.cr_mm);
        let ([wh, wv], [sh, sv], [rh, rv]) = (self.w0_mm, self.table_sense, self.rest_mm);
        let side = |m: &PkmMoma4s, cr_mm, w0_mm, table_sense, rest_mm| HvSideParameters {
            mechanism: m.into(),
            cr_mm,
            w0_mm,
            table_sense,
            rest_mm,
        };
        Some(HvMachineParameters {
            h: side(mh, ch, wh, sh, rh),
            v: side(mv, cv, wv, sv, rv),
            head: self
                .has_head
                .then_some(HeadParameters { c_mm: self.head_c_mm, head_sense: self.head_sense }),
            active: spindle(self.active)?,
        })
    }

    /// Fig 2b with the default dimensions (inferred).
    pub(crate) fn seven() -> Self {
        let p = HvMachineParameters::seven();
        let head = HvMillParameters::v(5).head.unwrap_or(HeadParameters { c_mm: [0.0; 3], head_sense: 1 });
        Self {
            mechanism: [p.h.mechanism.into(), p.v.mechanism.into()],
            cr_mm: [p.h.cr_mm, p.v.cr_mm],
            w0_mm: [p.h.w0_mm, p.v.w0_mm],
            table_sense: [p.h.table_sense, p.v.table_sense],
            rest_mm: [p.h.rest_mm, p.v.rest_mm],
            has_head: true,
            head_c_mm: head.c_mm,
            head_sense: head.head_sense,
            active: b'H',
        }
    }
}

/// One mechanism of the HV-Mill alone, `spindle` `'H'` or `'V'`; `controlled_axes` 3 (no rotary axis), 4 (table) or 5 (table and
/// head, V only).
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmHvMill {
    pub spindle: u8,
    pub controlled_axes: u8,
    pub mechanism: PkmMoma4s,
    pub cr_mm: [f64; 3],
    pub w0_mm: [f64; 3],
    pub table_sense: i8,
    /// V only.
    pub has_head: bool,
    pub head_c_mm: [f64; 3],
    pub head_sense: i8,
}

impl PkmHvMill {
    /// The parameters; `None` if `spindle` is neither `'H'` nor `'V'`.
    pub(crate) fn checked(&self) -> Option<HvMillParameters> {
        Some(HvMillParameters {
            spindle: spindle(self.spindle)?,
            controlled_axes: self.controlled_axes,
            mechanism: (&self.mechanism).into(),
            cr_mm: self.cr_mm,
            w0_mm: self.w0_mm,
            table_sense: self.table_sense,
            head: self
                .has_head
                .then_some(HeadParameters { c_mm: self.head_c_mm, head_sense: self.head_sense }),
        })
    }

    /// The default dimensions of `'H'` or `'V'` (inferred).
    pub(crate) fn named(letter: u8, controlled_axes: u8) -> Option<Self> {
        let p = match spindle(letter)? {
            Spindle::H => HvMillParameters::h(controlled_axes),
            Spindle::V => HvMillParameters::v(controlled_axes),
        };
        let head = p.head.unwrap_or(HeadParameters { c_mm: [0.0; 3], head_sense: 1 });
        Some(Self {
            spindle: letter,
            controlled_axes,
            mechanism: p.mechanism.into(),
            cr_mm: p.cr_mm,
            w0_mm: p.w0_mm,
            table_sense: p.table_sense,
            has_head: p.head.is_some(),
            head_c_mm: head.c_mm,
            head_sense: head.head_sense,
        })
    }
}

/// `'H'` or `'V'`.
pub(crate) fn spindle(letter: u8) -> Option<Spindle> {
    match letter {
        b'H' => Some(Spindle::H),
        b'V' => Some(Spindle::V),
        _ => None,
    }
}

/// O-X glide; `form` is `'O'` or `'X'`.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmOxGlide {
    pub l_mm: f64,
    pub s_mm: f64,
    pub form: u8,
    pub c_min_mm: f64,
}

impl PkmOxGlide {
    /// The parameters; `None` if `form` is neither `'O'` nor `'X'`.
    pub(crate) fn checked(&self) -> Option<OxGlideParameters> {
        let form = match self.form {
            b'O' => OxForm::O,
            b'X' => OxForm::X,
            _ => return None,
        };
        Some(OxGlideParameters { l_mm: self.l_mm, s_mm: self.s_mm, form, c_min_mm: self.c_min_mm })
    }
}

/// Lambda. `spacing_mm` of {0, 0} and a cone of 0 are no limits.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmLambda6 {
    pub base_radius_mm: f64,
    pub platform_radius_mm: f64,
    pub c_mm: [f64; 3],
    pub r_mm: [f64; 3],
    pub u_mm: [f64; 3],
    pub yaw_offset_deg: f64,
    pub assembly: i8,
    pub spacing_mm: [f64; 2],
    pub platform_cone_deg: f64,
    pub sigma_min: f64,
}

impl From<&PkmLambda6> for Lambda6Parameters {
    fn from(p: &PkmLambda6) -> Self {
        Self {
            base_radius_mm: p.base_radius_mm,
            platform_radius_mm: p.platform_radius_mm,
            c_mm: p.c_mm,
            r_mm: p.r_mm,
            u_mm: p.u_mm,
            yaw_offset_deg: p.yaw_offset_deg,
            assembly: p.assembly,
            spacing_mm: (p.spacing_mm != [0.0, 0.0]).then_some(p.spacing_mm),
            platform_cone_deg: limit(p.platform_cone_deg),
            sigma_min: p.sigma_min,
        }
    }
}

impl PkmLambda6 {
    /// The default machine, set `yaw45` (inferred dimensions).
    pub(crate) fn yaw45() -> Self {
        let p = Lambda6Parameters::from(Lambda6Set::Yaw45);
        Self {
            base_radius_mm: p.base_radius_mm,
            platform_radius_mm: p.platform_radius_mm,
            c_mm: p.c_mm,
            r_mm: p.r_mm,
            u_mm: p.u_mm,
            yaw_offset_deg: p.yaw_offset_deg,
            assembly: p.assembly,
            spacing_mm: p.spacing_mm.unwrap_or([0.0; 2]),
            platform_cone_deg: 0.0,
            sigma_min: p.sigma_min,
        }
    }
}

/// Linear delta.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmLinearDelta {
    pub joint_radius_mm: f64,
    pub joint_length_mm: f64,
}

impl From<&PkmLinearDelta> for LinearDeltaParameters {
    fn from(p: &PkmLinearDelta) -> Self {
        Self { joint_radius_mm: p.joint_radius_mm, joint_length_mm: p.joint_length_mm }
    }
}

/// Hexapod.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub struct PkmHexapod {
    pub base_mm: [[f64; 3]; 6],
    pub platform_mm: [[f64; 3]; 6],
    pub start_z_mm: f64,
}

impl From<&PkmHexapod> for HexapodParameters {
    fn from(p: &PkmHexapod) -> Self {
        Self { base_mm: p.base_mm, platform_mm: p.platform_mm, start_z_mm: p.start_z_mm }
    }
}
