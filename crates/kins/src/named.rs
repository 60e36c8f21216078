//! The parameters of every mechanism as a flat list of named numbers: how HAL sees a geometry, and what a calibration or a
//! sensitivity analysis turns.
//!
//! One definition gives the names, reads the numbers and writes them. A name has two levels, the part and the quantity, as
//! HAL pins do: `1.rail-angle`. Chains are counted from 1, as in the papers. Units as in machine files: mm and degrees.
//! Where a machine file may leave a limit out, 0 stands for "no limit".

use crate::{
    HeadParameters, HexapodParameters, HvMachineParameters, HvMillParameters, HvSideParameters,
    Lambda6Parameters, LinearDeltaParameters, Moma4sParameters, MomaParameters, MomaWParameters, OxForm,
    OxGlideParameters, PlanarParameters, Spindle, Vec2, Vec3,
};

/// The name of a parameter: `part.quantity`, or the quantity alone where `part` is empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Name {
    /// Which chain, leg or mechanism; may be empty.
    pub part: &'static str,
    /// What it is, e.g. `rail-angle`.
    pub quantity: &'static str,
}

impl core::fmt::Display for Name {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if !self.part.is_empty() {
            write!(f, "{}.", self.part)?;
        }
        f.write_str(self.quantity)
    }
}

/// A parameter's place.
#[derive(Debug, PartialEq)]
pub enum Slot<'a> {
    /// mm, degrees or dimensionless.
    Number(&'a mut f64),
    /// A sign or a count.
    Integer(&'a mut i8),
    /// Yes or no.
    Flag(&'a mut bool),
}

/// Parameters that can be listed.
pub trait Named {
    /// Shows every parameter, always in the same order; what the visitor writes is kept.
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>));
}

/// The parameters of one part.
struct Part<'v, F> {
    part: &'static str,
    visitor: &'v mut F,
}

impl<'v, F: FnMut(Name, Slot<'_>)> Part<'v, F> {
    fn new(part: &'static str, visitor: &'v mut F) -> Self {
        Self { part, visitor }
    }

    fn number(&mut self, quantity: &'static str, value: &mut f64) -> &mut Self {
        (self.visitor)(Name { part: self.part, quantity }, Slot::Number(value));
        self
    }

    fn integer(&mut self, quantity: &'static str, value: &mut i8) -> &mut Self {
        (self.visitor)(Name { part: self.part, quantity }, Slot::Integer(value));
        self
    }

    fn flag(&mut self, quantity: &'static str, value: &mut bool) -> &mut Self {
        (self.visitor)(Name { part: self.part, quantity }, Slot::Flag(value));
        self
    }

    fn vec2(&mut self, [nx, ny]: [&'static str; 2], [x, y]: &mut Vec2) -> &mut Self {
        self.number(nx, x).number(ny, y)
    }

    fn vec3(&mut self, [nx, ny, nz]: [&'static str; 3], [x, y, z]: &mut Vec3) -> &mut Self {
        self.number(nx, x).number(ny, y).number(nz, z)
    }

    /// 0 = none.
    fn limit(&mut self, quantity: &'static str, value: &mut Option<f64>) -> &mut Self {
        let mut number = value.unwrap_or(0.0);
        self.number(quantity, &mut number);
        *value = (number != 0.0).then_some(number);
        self
    }
}

impl Named for MomaParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        let [r1, r2] = &mut self.reference_mm;
        let [a1, a2] = &mut self.guide_angle_deg;
        let [l1, l2] = &mut self.l_mm;
        let [m1, m2] = &mut self.working_mode;
        for (part, r, angle, l, mode) in [("1", r1, a1, l1, m1), ("2", r2, a2, l2, m2)] {
            Part::new(part, visitor)
                .vec2(["reference-x", "reference-y"], r)
                .number("rail-angle", angle)
                .number("link-length", l)
                .integer("working-mode", mode);
        }
        Part::new("", visitor).integer("assembly", &mut self.assembly).flag("one-sided", &mut self.one_sided);
    }
}

impl Named for PlanarParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        let [r1, r2] = &mut self.reference_mm;
        let [a1, a2] = &mut self.guide_angle_deg;
        let [l1, l2] = &mut self.l_mm;
        let [o1, o2] = &mut self.offset_mm;
        let [m1, m2] = &mut self.working_mode;
        for (part, r, angle, l, offset, mode) in [("1", r1, a1, l1, o1, m1), ("2", r2, a2, l2, o2, m2)] {
            Part::new(part, visitor)
                .vec2(["reference-x", "reference-y"], r)
                .number("rail-angle", angle)
                .number("link-length", l)
                .vec2(["offset-x", "offset-y"], offset)
                .integer("working-mode", mode);
        }
        Part::new("", visitor).integer("assembly", &mut self.assembly).flag("one-sided", &mut self.one_sided);
    }
}

impl Moma4sParameters {
    /// The two drives under `drives`, the rest under `part`. `rail-angle` is γ, from the vertical.
    fn visit_as(
        &mut self,
        drives: [&'static str; 2],
        part: &'static str,
        visitor: &mut impl FnMut(Name, Slot<'_>),
    ) {
        let [d1, d2] = drives;
        let [o1, o2] = &mut self.pivot_mm;
        let [rho1, rho2] = &mut self.rho_mm;
        let [g1, g2] = &mut self.gamma_deg;
        let [l1, l2] = &mut self.l_mm;
        let [h1, h2] = &mut self.l_h_mm;
        let [m1, m2] = &mut self.working_mode;
        for (part, pivot, rho, gamma, l, h, mode) in
            [(d1, o1, rho1, g1, l1, h1, m1), (d2, o2, rho2, g2, l2, h2, m2)]
        {
            Part::new(part, visitor)
                .vec2(["pivot-x", "pivot-y"], pivot)
                .vec2(["reference-x", "reference-y"], rho)
                .number("rail-angle", gamma)
                .number("link-length", l)
                .number("platform-offset", h)
                .integer("working-mode", mode);
        }
        Part::new(part, visitor)
            .number("tool-length", &mut self.l_t_mm)
            .number("tool-angle", &mut self.alpha_t_deg)
            .integer("assembly", &mut self.assembly)
            .flag("one-sided", &mut self.one_sided);
    }
}

impl Named for Moma4sParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        self.visit_as(["1", "2"], "", visitor);
    }
}

impl Named for MomaWParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        let [m1, m2] = &mut self.mechanism;
        m1.visit_as(["1", "2"], "m1", visitor);
        m2.visit_as(["3", "4"], "m2", visitor);
        Part::new("", visitor)
            .vec3(["plane-x", "plane-y", "plane-z"], &mut self.b_mm)
            .vec3(["workpiece-x", "workpiece-y", "workpiece-z"], &mut self.w_mm)
            .number("contour-distance", &mut self.contour_distance_mm)
            .limit("max-wire-length", &mut self.max_wire_length_mm)
            .limit("max-wire-tilt", &mut self.max_wire_tilt_deg);
    }
}

const TABLE: [&str; 3] = ["table-x", "table-y", "table-z"];
const WORKPIECE: [&str; 3] = ["workpiece-x", "workpiece-y", "workpiece-z"];

/// The head's centre and sense; no head where the sense is 0.
fn visit_head(head: &mut Option<HeadParameters>, visitor: &mut impl FnMut(Name, Slot<'_>)) {
    let mut all = head.unwrap_or(HeadParameters { c_mm: [0.0; 3], head_sense: 0 });
    Part::new("head", visitor)
        .vec3(["centre-x", "centre-y", "centre-z"], &mut all.c_mm)
        .integer("sense", &mut all.head_sense);
    *head = (all.head_sense != 0).then_some(all);
}

impl Named for HvMillParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        self.mechanism.visit_as(["1", "2"], "", visitor);
        let mut vertical = self.spindle == Spindle::V;
        let mut axes = i8::try_from(self.controlled_axes).unwrap_or(i8::MAX);
        Part::new("", visitor)
            .flag("vertical", &mut vertical)
            .integer("controlled-axes", &mut axes)
            .vec3(TABLE, &mut self.cr_mm)
            .vec3(WORKPIECE, &mut self.w0_mm)
            .integer("table-sense", &mut self.table_sense);
        self.spindle = if vertical { Spindle::V } else { Spindle::H };
        self.controlled_axes = u8::try_from(axes).unwrap_or(0);
        visit_head(&mut self.head, visitor);
    }
}

impl HvSideParameters {
    fn visit_as(
        &mut self,
        drives: [&'static str; 2],
        part: &'static str,
        visitor: &mut impl FnMut(Name, Slot<'_>),
    ) {
        self.mechanism.visit_as(drives, part, visitor);
        let [rest1, rest2] = &mut self.rest_mm;
        Part::new(part, visitor)
            .vec3(TABLE, &mut self.cr_mm)
            .vec3(WORKPIECE, &mut self.w0_mm)
            .integer("table-sense", &mut self.table_sense)
            .number("rest-1", rest1)
            .number("rest-2", rest2);
    }
}

impl Named for HvMachineParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        let mut vertical = self.active == Spindle::V;
        Part::new("", visitor).flag("vertical", &mut vertical);
        self.active = if vertical { Spindle::V } else { Spindle::H };
        self.h.visit_as(["h1", "h2"], "h", visitor);
        self.v.visit_as(["v1", "v2"], "v", visitor);
        visit_head(&mut self.head, visitor);
    }
}

impl Named for OxGlideParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        let mut crossed = self.form == OxForm::X;
        Part::new("", visitor)
            .number("link-length", &mut self.l_mm)
            .number("platform-width", &mut self.s_mm)
            .number("switch-guard", &mut self.c_min_mm)
            .flag("crossed", &mut crossed);
        self.form = if crossed { OxForm::X } else { OxForm::O };
    }
}

impl Named for Lambda6Parameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        let [c1, c2, c3] = &mut self.c_mm;
        let [r1, r2, r3] = &mut self.r_mm;
        let [u1, u2, u3] = &mut self.u_mm;
        for (part, c, r, u) in [("1", c1, r1, u1), ("2", c2, r2, u2), ("3", c3, r3, u3)] {
            Part::new(part, visitor)
                .number("long-chain", c)
                .number("platform-to-elbow", r)
                .number("short-chain", u);
        }
        let [mut low, mut high] = self.spacing_mm.unwrap_or([0.0; 2]);
        Part::new("", visitor)
            .number("base-radius", &mut self.base_radius_mm)
            .number("platform-radius", &mut self.platform_radius_mm)
            .number("yaw-offset", &mut self.yaw_offset_deg)
            .integer("assembly", &mut self.assembly)
            .number("min-spacing", &mut low)
            .number("max-spacing", &mut high)
            .limit("platform-cone", &mut self.platform_cone_deg)
            .number("min-sigma", &mut self.sigma_min);
        self.spacing_mm = (low != 0.0 || high != 0.0).then_some([low, high]);
    }
}

impl Named for LinearDeltaParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        Part::new("", visitor)
            .number("joint-radius", &mut self.joint_radius_mm)
            .number("joint-length", &mut self.joint_length_mm);
    }
}

impl Named for HexapodParameters {
    fn visit(&mut self, visitor: &mut impl FnMut(Name, Slot<'_>)) {
        let struts = self.base_mm.iter_mut().zip(&mut self.platform_mm);
        for ((base, platform), part) in struts.zip(["1", "2", "3", "4", "5", "6"]) {
            Part::new(part, visitor)
                .vec3(["base-x", "base-y", "base-z"], base)
                .vec3(["platform-x", "platform-y", "platform-z"], platform);
        }
        Part::new("", visitor).number("start-z", &mut self.start_z_mm);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::{Lambda6Set, MomaConfiguration};
    use std::vec::Vec;

    /// Names are unique, and writing back what was read changes nothing.
    fn lists<P: Named + Copy + PartialEq + core::fmt::Debug>(parameters: P, count: usize) {
        let mut names: Vec<Name> = Vec::new();
        let mut copy = parameters;
        copy.visit(&mut |name, _| {
            assert!(!names.contains(&name), "{name} twice");
            names.push(name);
        });
        assert_eq!(copy, parameters);
        assert_eq!(names.len(), count, "{parameters:?}");
        // Every slot is a place of its own: a number written to one is read from that one alone.
        for (turned, name) in names.iter().enumerate() {
            let mut other = parameters;
            let mut index = 0;
            other.visit(&mut |_, slot| {
                if index == turned {
                    match slot {
                        Slot::Number(number) => *number += 1.0,
                        Slot::Integer(integer) => *integer = integer.wrapping_add(1),
                        Slot::Flag(flag) => *flag = !*flag,
                    }
                }
                index += 1;
            });
            // A head whose sense becomes 2 is still a head; its numbers without one are not kept.
            assert!(other != parameters || name.part == "head", "{name} is not kept");
        }
    }

    #[test]
    fn every_mechanism_is_listed() {
        lists(MomaParameters::from(MomaConfiguration::A), 12);
        lists(Moma4sParameters::from(crate::Moma4sConfiguration::S5), 20);
        lists(MomaWParameters::default(), 49);
        lists(HvMillParameters::v(5), 33);
        lists(HvMachineParameters::six(), 63);
        lists(HvMachineParameters::seven(), 63);
        lists(OxGlideParameters::from(OxForm::X), 4);
        lists(Lambda6Parameters::from(Lambda6Set::Wide), 17);
        lists(LinearDeltaParameters { joint_radius_mm: 140.0, joint_length_mm: 270.0 }, 2);
        lists(HexapodParameters::symmetric(300.0, 0.4, 150.0, 0.4, 400.0), 37);
    }
}
