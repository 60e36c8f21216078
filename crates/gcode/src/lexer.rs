//! Tokens of the prepared line, read with `nom`. This is the one file that knows the library's combinators; the
//! expression layer uses its result type only.
//!
//! Input is the rest of the line: its length says where a token begins, because all rests end together.

use crate::error::ErrorKind;
use nom::branch::alt;
use nom::bytes::complete::{tag, take_till, take_while, take_while1};
use nom::character::complete::{char, digit1, one_of};
use nom::combinator::{map, opt, recognize, value};
use nom::error::ParseError;
use nom::sequence::{delimited, preceded};
use nom::{IResult, Parser};

/// The rest of a prepared line.
pub(crate) type Rest<'a> = &'a [u8];

/// A token or value and the rest after it.
pub(crate) type Read<'a, T> = IResult<Rest<'a>, T, Fault>;

/// What is wrong, and the stretch as lengths of the rests at its begin and end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fault {
    pub(crate) kind: ErrorKind,
    pub(crate) begin: usize,
    pub(crate) end: usize,
}

impl<'a> ParseError<Rest<'a>> for Fault {
    fn from_error_kind(input: Rest<'a>, _: nom::error::ErrorKind) -> Self {
        Fault { kind: ErrorKind::NumberMissing, begin: input.len(), end: input.len().saturating_sub(1) }
    }

    fn append(_: Rest<'a>, _: nom::error::ErrorKind, other: Self) -> Self {
        other
    }
}

/// A definite error about the stretch from `from` up to `to`.
pub(crate) fn fault(kind: ErrorKind, from: Rest<'_>, to: Rest<'_>) -> nom::Err<Fault> {
    nom::Err::Failure(Fault { kind, begin: from.len(), end: to.len() })
}

/// A definite error about the one byte at `at`.
pub(crate) fn fault_here(kind: ErrorKind, at: Rest<'_>) -> nom::Err<Fault> {
    nom::Err::Failure(Fault { kind, begin: at.len(), end: at.len().saturating_sub(1) })
}

/// The fault inside a nom error.
pub(crate) fn into_fault(error: nom::Err<Fault>) -> Fault {
    match error {
        nom::Err::Error(fault) | nom::Err::Failure(fault) => fault,
        nom::Err::Incomplete(_) => Fault { kind: ErrorKind::NumberMissing, begin: 0, end: 0 },
    }
}

/// A decimal number: optional sign, digits, at most one point, at least one digit; no exponent.
pub(crate) fn number(input: Rest<'_>) -> Read<'_, f64> {
    let (rest, text) =
        recognize((opt(one_of("+-")), take_while(|b: u8| b.is_ascii_digit() || b == b'.'))).parse(input)?;
    match decimal(text) {
        Some(number) => Ok((rest, number)),
        None if text.is_empty() => Err(fault_here(ErrorKind::NumberMissing, input)),
        None => Err(fault(ErrorKind::BadNumber, input, rest)),
    }
}

/// The value of `[+-]digits[.digits]`, correctly rounded.
fn decimal(text: &[u8]) -> Option<f64> {
    // Up to 15 digits and 10^-15: both exact in f64, so one division rounds correctly.
    let (mut mantissa, mut digits, mut decimals, mut point) = (0_u64, 0_usize, 0_usize, false);
    for &byte in text {
        match byte {
            b'.' if point => return None,
            b'.' => point = true,
            b'0'..=b'9' => {
                digits += 1;
                decimals += usize::from(point);
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
            }
            _ => {}
        }
    }
    match digits {
        0 => None,
        1..=15 => {
            let magnitude = mantissa as f64 / POWERS[decimals];
            Some(if text.first() == Some(&b'-') { -magnitude } else { magnitude })
        }
        _ => core::str::from_utf8(text).ok()?.parse().ok(),
    }
}

const POWERS: [f64; 16] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// The digits of a line number after its N, with an optional fraction.
pub(crate) fn line_number(input: Rest<'_>) -> Read<'_, ()> {
    value((), (digit1, opt(preceded(char('.'), digit1)))).parse(input)
}

/// A name in angle brackets; the result is what stands between them.
pub(crate) fn name(input: Rest<'_>) -> Read<'_, &[u8]> {
    delimited(char('<'), take_till(|b| b == b'>'), char('>')).parse(input)
}

/// A comment in parentheses; the result is what stands between them.
pub(crate) fn comment(input: Rest<'_>) -> Read<'_, &[u8]> {
    delimited(char('('), take_till(|b| b == b')'), char(')')).parse(input)
}

/// Letters.
pub(crate) fn letters(input: Rest<'_>) -> Read<'_, &[u8]> {
    take_while1(|b: u8| b.is_ascii_lowercase()).parse(input)
}

/// An operator between two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum Operator {
    Power,
    Multiply,
    Divide,
    Modulo,
    Add,
    Subtract,
    Equal,
    NotEqual,
    Greater,
    GreaterEqual,
    Less,
    LessEqual,
    And,
    Or,
    Xor,
}

impl Operator {
    /// Higher binds tighter (RS274/NGC 3.3.2.3, LinuxCNC's comparison level between + - and the logical ones).
    pub(crate) const fn level(self) -> u8 {
        match self {
            Self::Power => 6,
            Self::Multiply | Self::Divide | Self::Modulo => 5,
            Self::Add | Self::Subtract => 4,
            Self::Equal
            | Self::NotEqual
            | Self::Greater
            | Self::GreaterEqual
            | Self::Less
            | Self::LessEqual => 3,
            Self::And | Self::Or | Self::Xor => 2,
        }
    }
}

/// An operator.
pub(crate) fn operator(input: Rest<'_>) -> Read<'_, Operator> {
    alt((
        value(Operator::Power, tag("**")),
        value(Operator::Multiply, char('*')),
        value(Operator::Divide, char('/')),
        value(Operator::Add, char('+')),
        value(Operator::Subtract, char('-')),
        value(Operator::Modulo, tag("mod")),
        value(Operator::Equal, tag("eq")),
        value(Operator::NotEqual, tag("ne")),
        value(Operator::GreaterEqual, tag("ge")),
        value(Operator::Greater, tag("gt")),
        value(Operator::LessEqual, tag("le")),
        value(Operator::Less, tag("lt")),
        value(Operator::And, tag("and")),
        value(Operator::Or, tag("or")),
        value(Operator::Xor, tag("xor")),
    ))
    .parse(input)
}

/// A function of one argument (ATAN: of two).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum Function {
    Abs,
    Acos,
    Asin,
    Atan,
    Cos,
    Exists,
    Exp,
    Fix,
    Fup,
    Ln,
    Round,
    Sin,
    Sqrt,
    Tan,
}

/// A function name.
pub(crate) fn function(input: Rest<'_>) -> Read<'_, Function> {
    alt((
        value(Function::Abs, tag("abs")),
        value(Function::Acos, tag("acos")),
        value(Function::Asin, tag("asin")),
        value(Function::Atan, tag("atan")),
        value(Function::Cos, tag("cos")),
        value(Function::Exists, tag("exists")),
        value(Function::Exp, tag("exp")),
        value(Function::Fix, tag("fix")),
        value(Function::Fup, tag("fup")),
        value(Function::Ln, tag("ln")),
        value(Function::Round, tag("round")),
        value(Function::Sin, tag("sin")),
        value(Function::Sqrt, tag("sqrt")),
        value(Function::Tan, tag("tan")),
    ))
    .parse(input)
}

/// The keyword of an o-word.
#[cfg(feature = "alloc")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum Keyword {
    Sub,
    Endsub,
    Call,
    Return,
    If,
    Elseif,
    Else,
    Endif,
    While,
    Endwhile,
    Do,
    Repeat,
    Endrepeat,
    Break,
    Continue,
}

/// The keyword of an o-word; longer ones first.
#[cfg(feature = "alloc")]
pub(crate) fn keyword(input: Rest<'_>) -> Read<'_, Keyword> {
    alt((
        value(Keyword::Sub, tag("sub")),
        value(Keyword::Endsub, tag("endsub")),
        value(Keyword::Call, tag("call")),
        value(Keyword::Return, tag("return")),
        value(Keyword::If, tag("if")),
        value(Keyword::Elseif, tag("elseif")),
        value(Keyword::Else, tag("else")),
        value(Keyword::Endif, tag("endif")),
        value(Keyword::While, tag("while")),
        value(Keyword::Endwhile, tag("endwhile")),
        value(Keyword::Do, tag("do")),
        value(Keyword::Repeat, tag("repeat")),
        value(Keyword::Endrepeat, tag("endrepeat")),
        value(Keyword::Break, tag("break")),
        value(Keyword::Continue, tag("continue")),
    ))
    .parse(input)
}

/// One given byte.
pub(crate) fn byte(expected: u8) -> impl Fn(Rest<'_>) -> Read<'_, ()> {
    move |input| map(char(expected as char), |_| ()).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers() {
        for (text, expected) in [
            ("1.", 1.0),
            ("-.5", -0.5),
            ("+.5x", 0.5),
            ("007", 7.0),
            ("-0.0", -0.0),
            ("0.1", 0.1),
            ("123456789012345678901234567890", 1.234_567_890_123_456_8e29),
            ("0.1000000000000000055511151231257827", 0.1),
        ] {
            let (_, value) = number(text.as_bytes()).unwrap();
            assert_eq!(value.to_bits(), f64::to_bits(expected), "{text}");
        }
        for text in ["", ".", "+", "-.", "1.5.", "1..", "x"] {
            assert!(number(text.as_bytes()).is_err(), "{text}");
        }
    }

    #[test]
    fn longest_keyword_wins() {
        #[cfg(feature = "alloc")]
        {
            assert_eq!(keyword(b"endwhile").unwrap().1, Keyword::Endwhile);
            assert_eq!(keyword(b"elseif[1]").unwrap().1, Keyword::Elseif);
        }
        assert_eq!(operator(b"**2").unwrap().1, Operator::Power);
        assert_eq!(operator(b"ge2").unwrap().1, Operator::GreaterEqual);
        assert_eq!(function(b"exists[").unwrap().1, Function::Exists);
    }
}
