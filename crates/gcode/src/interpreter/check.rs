//! Between reading and executing: which motion a block means, and whether every word has a code that uses it.

use super::state::State;
use crate::block::{AXIS_LETTERS, Block};
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use crate::settings::Dialect;
use pkm_canon::Plane;

/// Group-0 codes that take axis words.
const fn takes_axes(code: GCode) -> bool {
    matches!(code, G10 | G28 | G30 | G52 | G92)
}

impl State {
    /// Finds the block's motion and refuses words without use.
    pub(crate) fn complete(&self, block: &mut Block) -> Result<(), Error> {
        block.motion = self.motion_of(block)?;
        self.check_polar(block)?;
        check_g_codes(block, self)?;
        let remapped = self.without_remapped(block)?;
        match &remapped {
            // LinuxCNC looks no further.
            Some(_) if self.settings.dialect != Dialect::Pkm => return Ok(()),
            Some(_) => {}
            None => check_m_codes(block, self.settings.dialect)?,
        }
        if self.splines.is_open() && self.settings.dialect == Dialect::Pkm {
            self.check_open_spline(block)?;
        }
        self.check_words(remapped.as_ref().map_or(block, |rest| rest))
    }

    /// LinuxCNC looks at the plane in force before the block, whatever the block selects (checked with rs274 2.9); pkm at the
    /// one in which the move is made.
    fn check_polar(&self, block: &Block) -> Result<(), Error> {
        if self.settings.dialect != Dialect::Pkm && block.has_polar() && self.modal.plane != Plane::Xy {
            let letter = if block.has(b'@') { b'@' } else { b'^' };
            return Err(block.word_error(letter, ErrorKind::PolarPlane));
        }
        Ok(())
    }

    /// A block that holds a remapped code, without the words that its sub gets.
    #[cfg(feature = "alloc")]
    #[inline]
    fn without_remapped(&self, block: &Block) -> Result<Option<alloc::boxed::Box<Block>>, Error> {
        match self.remaps.is_empty() || !self.has_remapped_code(block) {
            true => Ok(None),
            false => self.rest_of_remapped(block).map(Some),
        }
    }

    #[cfg(not(feature = "alloc"))]
    fn without_remapped(&self, _: &Block) -> Result<Option<&'static Block>, Error> {
        Ok(None)
    }

    /// True for a G code that RS274 does not know and a sub stands for.
    fn is_free(&self, code: GCode) -> bool {
        #[cfg(feature = "alloc")]
        return !self.remaps.is_empty() && self.remaps.has_g(code);
        #[cfg(not(feature = "alloc"))]
        {
            let _ = code;
            false
        }
    }

    /// RS274/NGC 3.5: axis words without a motion code repeat the modal motion.
    fn motion_of(&self, block: &Block) -> Result<Option<GCode>, Error> {
        let (axes, polar) = (block.has_axis(), block.has_polar());
        let other = block.g(GGroup::NonModal).filter(|code| takes_axes(*code));
        if let Some(motion) = block.g(GGroup::Motion) {
            if motion == G80 {
                if polar || (axes && other.is_none()) {
                    return Err(block.motion_error(ErrorKind::AxisWithG80));
                }
            } else if let Some(other) = other {
                let kind = ErrorKind::AxisClash { first: Code(other), second: Code(motion) };
                return Err(block.motion_error(kind));
            } else if self.is_free(motion) {
                // Its argspec says what it needs.
            } else if !axes && !polar && !matches!(motion, G0 | G1 | G2 | G3 | G5_2 | G5_3 | G6_2 | 700..=722)
            {
                return Err(block.motion_error(ErrorKind::AxisMissing { code: Code(motion) }));
            }
        }
        if let Some(code @ (G52 | G92)) = other
            && !axes
        {
            return Err(block.g_error(GGroup::NonModal, ErrorKind::OffsetEmpty { code: Code(code) }));
        }
        if let Some(motion) = block.g(GGroup::Motion) {
            return Ok(Some(motion));
        }
        if other.is_some() {
            return Ok(None);
        }
        if axes || polar {
            if matches!(block.g(GGroup::ToolLength), Some(G43_1 | G43_2)) {
                return Ok(None);
            }
            // A spline needs its code in every block.
            if matches!(self.modal.motion, G80 | G5 | G5_1 | G6 | G6_1) {
                let letter = AXIS_LETTERS.iter().chain(b"@^").copied().find(|letter| block.has(*letter));
                return Err(block.word_error(letter.unwrap_or(b'X'), ErrorKind::AxisWithoutMotion));
            }
            return Ok(Some(self.modal.motion));
        }
        let repeats_arc = block.has_any(b"IJK") && matches!(self.modal.motion, G2 | G3);
        // A knot alone; LinuxCNC 2.10 wants its G6.2 again.
        let knot = block.has(b'K') && self.modal.motion == G6_2 && self.settings.dialect == Dialect::Pkm;
        Ok((repeats_arc || knot).then_some(self.modal.motion))
    }

    /// Dialect section 8: a word nobody uses is an error.
    fn check_words(&self, block: &Block) -> Result<(), Error> {
        let motion = block.motion.unwrap_or(G80);
        let newer = self.settings.dialect != Dialect::LinuxCnc29;
        let g0 = block.g(GGroup::NonModal);
        let tool_length = block.g(GGroup::ToolLength);
        let compensation = block.g(GGroup::Compensation);
        let path = block.g(GGroup::Path);
        let io = block.m(MGroup::Io);
        let user = block.m(MGroup::User).is_some_and(|number| !self.settings.machine_codes.contains(number));
        let spindle = block.m(MGroup::Spindle);
        if matches!(motion, G2 | G3) && block.has(b'P') {
            turns_of(block)?;
        }
        let needed: &[u8] = match motion {
            G33 | G33_1 => b"K",
            G76 => b"PIJK",
            _ => b"",
        };
        // Before anything of the block is executed (checked with rs274 2.9).
        if let Some(letter) = needed.iter().copied().find(|letter| !block.has(*letter)) {
            let kind = ErrorKind::WordMissing { letter: letter.into(), code: Code(motion) };
            return Err(block.motion_error(kind));
        }
        if motion == G76
            && let Some(value) = block.get(b'P').filter(|pitch| *pitch < 0.0)
        {
            return Err(block.word_error(b'P', ErrorKind::NegativeWord { letter: 'P', value }));
        }
        if spindle == Some(19) {
            // Before anything of the block is executed; Q only after the turn (checked with rs274 2.9).
            let wrong = |letter: u8, value| {
                Err(block.word_error(letter, ErrorKind::OrientRange { letter: letter.into(), value }))
            };
            match (block.get(b'R'), block.get(b'P')) {
                (Some(angle), _) if !(0.0..=360.0).contains(&angle) => return wrong(b'R', angle),
                (_, Some(way)) if ![0.0, 1.0, 2.0].contains(&way) => return wrong(b'P', way),
                _ => {}
            }
        }
        let roughing = matches!(motion, 710..=712 | 720..=722);
        let lathe = roughing || motion == 700;
        let unused = |letter: u8, users: &'static str| {
            Err(block.word_error(letter, ErrorKind::WordUnused { letter: letter.into(), users }))
        };
        if is_cycle(motion)
            && let Some(letter) = b"ABC".iter().copied().find(|letter| block.has(*letter))
        {
            return Err(block.word_error(letter, ErrorKind::CycleRotary { letter: letter.into() }));
        }
        if block.has(b'F') && matches!(motion, G33 | G33_1) {
            return unused(b'F', "moves at feed");
        }
        if block.has(b'D')
            && !(compensation.is_some_and(|code| code != 400)
                || lathe
                || block.g(GGroup::Spindle) == Some(G96)
                || (newer && matches!(motion, G73 | G83)))
        {
            return unused(b'D', "G41 G42 G41.1 G42.1 G70 to G72 and G96");
        }
        if block.has(b'E') && !(matches!(motion, G33 | G33_1 | 700 | G76) || matches!(io, Some(66..=68))) {
            return unused(b'E', "G33 G33.1 G70 G76 and M66 to M68");
        }
        if block.has(b'H') && !(matches!(tool_length, Some(G43 | G43_2)) || motion == G76) {
            return unused(b'H', "G43 G43.2 and G76");
        }
        let centre = matches!(motion, G2 | G3 | G5 | G5_1 | G6 | G6_1 | G87 | G76) || g0 == Some(G10);
        if block.has(b'I') && !(centre || motion == G33_1 || roughing) {
            return unused(b'I', "G2 G3 G5 G5.1 G6 G6.1 G10 G33.1 G71 G72 G76 and G87");
        }
        if block.has(b'J') && !centre {
            return unused(b'J', "G2 G3 G5 G5.1 G6 G6.1 G10 G76 and G87");
        }
        if block.has(b'K') && !matches!(motion, G2 | G3 | G6_2 | G33 | G33_1 | G76 | G87) {
            return unused(b'K', "G2 G3 G6.2 G33 G33.1 G76 and G87");
        }
        let cycle = is_cycle(motion);
        if block.has(b'L')
            && !((cycle && motion != G74)
                || matches!(motion, G5_2 | G6_2 | G76)
                || g0 == Some(G10)
                || compensation.is_some_and(|code| code != 400)
                || io == Some(66)
                || block.has_m(98))
        {
            return unused(b'L', "G5.2 G6.2 G10 G41 G42 G73 G76 G81 to G89 M66 and M98");
        }
        if block.has(b'P')
            && !(matches!(
                motion,
                G2 | G3 | G5 | G5_2 | G6 | G6_2 | 700 | G74 | G76 | G82 | G84 | G86 | G88 | G89
            ) || matches!(g0, Some(G4 | G10))
                || path == Some(G64)
                || spindle == Some(19)
                || matches!(block.m(MGroup::Override), Some(50..=53))
                || matches!(io, Some(62..=66))
                || block.has_m(98)
                || user)
        {
            return unused(
                b'P',
                "G2 G3 G4 G5 G5.2 G6 G6.2 G10 G64 G70 G74 G76 G82 G84 G86 G88 G89 M19 M50 to M53 M62 to M66 M98",
            );
        }
        if block.has(b'Q')
            && !(matches!(motion, G5 | G6 | G6_2 | G73 | G76 | G83)
                || lathe
                || g0 == Some(G10)
                || path == Some(G64)
                || spindle == Some(19)
                || block.m(MGroup::Tool) == Some(61)
                || matches!(io, Some(66..=68))
                || user)
        {
            return unused(b'Q', "G5 G6 G6.2 G10 G64 G70 to G73 G76 G83 M19 M61 M66 M67 and M68");
        }
        if block.has(b'R')
            && !(matches!(motion, G2 | G3 | G6_2 | G76)
                || cycle
                || roughing
                || g0 == Some(G10)
                || matches!(compensation, Some(411 | 421))
                || spindle == Some(19)
                || (newer && path == Some(G64)))
        {
            return unused(b'R', "G2 G3 G6.2 G10 G41.1 G42.1 G71 to G74 G76 G81 to G89 and M19");
        }
        if block.has(b'$')
            && !(block.has(b'S')
                || matches!(spindle, Some(3 | 4 | 5 | 19))
                || block.m(MGroup::Override) == Some(51)
                || matches!(motion, G33 | G33_1 | G74 | G76 | G84)
                || (newer && (block.g(GGroup::FeedMode) == Some(950) || block.g(GGroup::Spindle).is_some())))
        {
            return unused(b'$', "S M3 M4 M5 M19 M51 G33 G33.1 G74 G76 and G84");
        }
        Ok(())
    }
}

/// P of an arc: how many turns, before anything of the block is executed (checked with rs274 2.9).
pub(super) fn turns_of(block: &Block) -> Result<i32, Error> {
    match block.get(b'P') {
        None => Ok(1),
        Some(p) => {
            let turns = pkm_kins::maths::round(p);
            if (p - turns).abs() < 0.001 && (1.0..1e6).contains(&turns) {
                return Ok(turns as i32);
            }
            Err(block.word_error(b'P', ErrorKind::ArcTurns { value: p }))
        }
    }
}

fn check_g_codes(block: &Block, state: &State) -> Result<(), Error> {
    let fail = |kind| Err(block.g_error(GGroup::NonModal, kind));
    match block.g(GGroup::NonModal) {
        Some(G4) => {
            if block.get(b'P').is_none_or(|p| p < 0.0) {
                return fail(ErrorKind::DwellMissing);
            }
            if matches!(block.motion, Some(G2 | G3)) {
                return fail(ErrorKind::DwellWithArc);
            }
        }
        Some(G53) => {
            if !matches!(block.motion, Some(G0 | G1)) {
                return fail(ErrorKind::G53Motion);
            }
            let incremental = match block.g(GGroup::Distance) {
                Some(code) => code == 910,
                None => state.modal.incremental,
            };
            if incremental {
                return fail(ErrorKind::G53Incremental);
            }
        }
        _ => {}
    }
    Ok(())
}

fn check_m_codes(block: &Block, dialect: Dialect) -> Result<(), Error> {
    let fail = |kind| Err(block.m_error(MGroup::Io, kind));
    match block.m(MGroup::Io) {
        Some(number @ 62..=65) if !block.has(b'P') => fail(ErrorKind::IoMissing { number, letter: 'P' }),
        Some(number @ (67 | 68)) if !block.has(b'E') => fail(ErrorKind::IoMissing { number, letter: 'E' }),
        Some(number @ (67 | 68)) if !block.has(b'Q') && dialect == Dialect::Pkm => {
            fail(ErrorKind::IoMissing { number, letter: 'Q' })
        }
        _ => Ok(()),
    }
}
