//! Where pkm's own dialect goes another way than LinuxCNC's (docs/gcode.md, "Where the dialects differ").

mod support;

use pkm_canon::text::{Spelling, TextWriter};
use pkm_gcode::{Dialect, MemorySource, Settings, ToolTable, canon_text};

/// The canonical text of a program, and the identifier it is refused with.
fn canon(program: &str, settings: Settings) -> (String, Option<&'static str>) {
    let (mut output, mut refused) = (Vec::new(), None);
    let mut writer = TextWriter::new(|bytes: &[u8]| output.extend_from_slice(bytes), Spelling::V2_9);
    let tools = ToolTable::parse(support::TOOLS.as_bytes(), |_, _| {}).expect("a table");
    canon_text(settings, tools, &mut MemorySource::new(program.as_bytes()), &mut writer, |error, _| {
        refused = Some(error.kind.code());
        false
    });
    (String::from_utf8(output).expect("text"), refused)
}

fn of(dialect: Dialect) -> Settings {
    Settings { dialect, ..Settings::default() }
}

#[test]
fn mist_and_flood_share_a_block_in_pkm_only() {
    for program in ["M7 M8\nM2\n", "M8 M7\nM2\n"] {
        let (text, refused) = canon(program, of(Dialect::Pkm));
        assert_eq!(refused, None);
        assert!(text.contains("MIST_ON()") && text.contains("FLOOD_ON()"), "{text}");
        assert!(
            text.contains("MIST_OFF()") && text.contains("FLOOD_OFF()"),
            "the end switches both off: {text}"
        );
        assert_eq!(canon(program, of(Dialect::LinuxCnc29)).1, Some("modal-clash"));
    }
    assert_eq!(canon("M7 M9\nM2\n", of(Dialect::Pkm)).1, Some("modal-clash"));
    for third in ["M7", "M8", "M9"] {
        let program = format!("M7 M8 {third}\nM2\n");
        assert_eq!(canon(&program, of(Dialect::Pkm)).1, Some("modal-clash"), "{third}");
    }
}

#[test]
fn polar_words_are_judged_by_the_plane_of_their_move_in_pkm() {
    let (leaves, enters) = ("G18 G0 @1 ^45\nM2\n", "G18\nG17 G0 @1 ^45\nM2\n");
    assert_eq!(canon(leaves, of(Dialect::Pkm)).1, Some("polar-plane"));
    assert_eq!(canon(enters, of(Dialect::Pkm)).1, None);
    // As rs274 2.9 does: the plane before the block counts, and it is judged before F takes effect.
    assert_eq!(canon(leaves, of(Dialect::LinuxCnc29)).1, None);
    let (text, refused) = canon("G18\nF100 G17 G0 @1 ^45\nM2\n", of(Dialect::LinuxCnc29));
    assert_eq!(refused, Some("polar-plane"));
    assert!(!text.contains("SET_FEED_RATE"), "{text}");
    assert_eq!(canon(enters, of(Dialect::LinuxCnc29)).1, Some("polar-plane"));
}

#[test]
fn a_byte_order_mark_is_refused_by_name_but_in_pkm() {
    let program = "\u{feff}G0 X1\nM2\n";
    assert_eq!(canon(program, of(Dialect::Pkm)).1, None);
    assert_eq!(canon(program, of(Dialect::LinuxCnc29)).1, Some("bad-char"));
}

#[test]
fn retain_g43_takes_the_new_tools_length() {
    let program = "T1 M6 G43\nT3 M6\nT0 M6\nT1 M6\nM2\n";
    let offsets = |retain_g43| -> Vec<String> {
        let (text, refused) = canon(program, Settings { retain_g43, ..of(Dialect::Pkm) });
        assert_eq!(refused, None);
        let commands = text.lines().filter_map(|line| line.split_once("USE_TOOL_LENGTH_OFFSET("));
        commands.map(|(_, numbers)| numbers.split([',', ' ']).nth(2).expect("Z").to_owned()).collect()
    };
    // T0 cancels it: the tool after that has none.
    assert_eq!(offsets(true), ["0.5110", "1.2730", "0.0000"]);
    assert_eq!(offsets(false), ["0.5110"]);
}
