//! The machines that ship, by name.

/// Name and text of every shipped machine file, in the order in which they are listed.
pub const SHIPPED: &[(&str, &str)] = &[
    ("moma-a", include_str!("../../../machines/moma-a.toml")),
    ("moma-b", include_str!("../../../machines/moma-b.toml")),
    ("moma-c", include_str!("../../../machines/moma-c.toml")),
    ("moma-d", include_str!("../../../machines/moma-d.toml")),
    ("moma-4s-p", include_str!("../../../machines/moma-4s-p.toml")),
    ("moma-4s-s5", include_str!("../../../machines/moma-4s-s5.toml")),
    ("moma-4s-s10", include_str!("../../../machines/moma-4s-s10.toml")),
    ("moma-4s-u5", include_str!("../../../machines/moma-4s-u5.toml")),
    ("moma-4s-u10", include_str!("../../../machines/moma-4s-u10.toml")),
    ("moma-w", include_str!("../../../machines/moma-w.toml")),
    ("hv-mill-h3", include_str!("../../../machines/hv-mill-h3.toml")),
    ("hv-mill-h4", include_str!("../../../machines/hv-mill-h4.toml")),
    ("hv-mill-v3", include_str!("../../../machines/hv-mill-v3.toml")),
    ("hv-mill-v4", include_str!("../../../machines/hv-mill-v4.toml")),
    ("hv-mill-v5", include_str!("../../../machines/hv-mill-v5.toml")),
    ("hv-mill-6", include_str!("../../../machines/hv-mill-6.toml")),
    ("hv-mill-7", include_str!("../../../machines/hv-mill-7.toml")),
    ("ox-glide-o", include_str!("../../../machines/ox-glide-o.toml")),
    ("ox-glide-x", include_str!("../../../machines/ox-glide-x.toml")),
    ("lambda6", include_str!("../../../machines/lambda6.toml")),
    ("lambda6-paper", include_str!("../../../machines/lambda6-paper.toml")),
    ("xyz", include_str!("../../../machines/xyz.toml")),
    ("xyzabc", include_str!("../../../machines/xyzabc.toml")),
];

/// Name and text of every shipped family: a machine file with a table `[configure]`; by itself it is its first configuration.
pub const FAMILIES: &[(&str, &str)] = &[
    ("moma", include_str!("../../../machines/moma.toml")),
    ("moma-4s", include_str!("../../../machines/moma-4s.toml")),
    ("ox-glide", include_str!("../../../machines/ox-glide.toml")),
    ("hv-mill", include_str!("../../../machines/hv-mill.toml")),
];

/// The text of a shipped machine or family file.
pub fn text(name: &str) -> Option<&'static str> {
    SHIPPED.iter().chain(FAMILIES).find(|(shipped, _)| *shipped == name).map(|(_, text)| *text)
}
