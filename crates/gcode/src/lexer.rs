//! Tokens of the prepared line, read with `nom`. This is the one file that knows the library's combinators; the
//! expression layer uses its result type only.
//!
//! Input is the rest of the line: its length says where a token begins, because all rests end together.

use crate::error::ErrorKind;
use nom::bytes::complete::{take_till, take_while1};
use nom::character::complete::{char, digit1};
use nom::combinator::{map, opt, value};
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

/// A decimal number: optional sign, digits, at most one point, at least one digit; no exponent. Correctly rounded.
pub(crate) fn number(input: Rest<'_>) -> Read<'_, f64> {
    let (negative, unsigned) = match input {
        [sign @ (b'+' | b'-'), unsigned @ ..] => (*sign == b'-', unsigned),
        _ => (false, input),
    };
    let (rest, whole) = digits(unsigned, 0);
    let (rest, mantissa, decimals, points) = match rest {
        [b'.', fraction @ ..] => {
            let (rest, mantissa) = digits(fraction, whole);
            (rest, mantissa, fraction.len() - rest.len(), 1)
        }
        _ => (rest, whole, 0, 0),
    };
    let count = unsigned.len() - rest.len() - points;
    if count == 0 || rest.first() == Some(&b'.') {
        return Err(not_a_number(input));
    }
    // Up to 15 digits and 10^-15: both exact in f64, so one division rounds correctly.
    if count <= 15 {
        let magnitude = mantissa as f64 / POWERS[decimals];
        return Ok((rest, if negative { -magnitude } else { magnitude }));
    }
    let text = core::str::from_utf8(&input[..input.len() - rest.len()]).unwrap_or_default();
    let number = text.parse().map_err(|_| not_a_number(input))?;
    Ok((rest, number))
}

/// Up to nine digits with no point behind them: what labels and parameter numbers mostly are.
pub(crate) fn plain_integer(input: Rest<'_>) -> Option<(Rest<'_>, i32)> {
    let (rest, number) = digits(input, 0);
    let count = input.len() - rest.len();
    ((1..=9).contains(&count) && rest.first() != Some(&b'.')).then_some((rest, number as i32))
}

/// Appends the digits that the input begins with to a number; it wraps around from 20 digits on.
#[inline]
fn digits(mut input: Rest<'_>, mut number: u64) -> (Rest<'_>, u64) {
    while let [digit @ b'0'..=b'9', rest @ ..] = input {
        number = number.wrapping_mul(10).wrapping_add(u64::from(digit - b'0'));
        input = rest;
    }
    (input, number)
}

/// The stretch that looks like a number.
#[cold]
fn not_a_number(input: Rest<'_>) -> nom::Err<Fault> {
    let is_sign = |byte: &u8| matches!(byte, b'+' | b'-');
    let sign = usize::from(input.first().is_some_and(is_sign));
    let length = input[sign..].iter().take_while(|byte| byte.is_ascii_digit() || **byte == b'.').count();
    match sign + length {
        0 => fault_here(ErrorKind::NumberMissing, input),
        length => fault(ErrorKind::BadNumber, input, &input[length..]),
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

const OPERATORS: [(&[u8], Operator); 15] = [
    (b"**", Operator::Power),
    (b"*", Operator::Multiply),
    (b"/", Operator::Divide),
    (b"+", Operator::Add),
    (b"-", Operator::Subtract),
    (b"mod", Operator::Modulo),
    (b"eq", Operator::Equal),
    (b"ne", Operator::NotEqual),
    (b"ge", Operator::GreaterEqual),
    (b"gt", Operator::Greater),
    (b"le", Operator::LessEqual),
    (b"lt", Operator::Less),
    (b"and", Operator::And),
    (b"or", Operator::Or),
    (b"xor", Operator::Xor),
];

/// An operator.
pub(crate) fn operator(input: Rest<'_>) -> Read<'_, Operator> {
    word(&OPERATORS, input)
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

const FUNCTIONS: [(&[u8], Function); 14] = [
    (b"abs", Function::Abs),
    (b"acos", Function::Acos),
    (b"asin", Function::Asin),
    (b"atan", Function::Atan),
    (b"cos", Function::Cos),
    (b"exists", Function::Exists),
    (b"exp", Function::Exp),
    (b"fix", Function::Fix),
    (b"fup", Function::Fup),
    (b"ln", Function::Ln),
    (b"round", Function::Round),
    (b"sin", Function::Sin),
    (b"sqrt", Function::Sqrt),
    (b"tan", Function::Tan),
];

/// A function name.
pub(crate) fn function(input: Rest<'_>) -> Read<'_, Function> {
    word(&FUNCTIONS, input)
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

#[cfg(feature = "alloc")]
const KEYWORDS: [(&[u8], Keyword); 15] = [
    (b"sub", Keyword::Sub),
    (b"endsub", Keyword::Endsub),
    (b"call", Keyword::Call),
    (b"return", Keyword::Return),
    (b"if", Keyword::If),
    (b"elseif", Keyword::Elseif),
    (b"else", Keyword::Else),
    (b"endif", Keyword::Endif),
    (b"while", Keyword::While),
    (b"endwhile", Keyword::Endwhile),
    (b"do", Keyword::Do),
    (b"repeat", Keyword::Repeat),
    (b"endrepeat", Keyword::Endrepeat),
    (b"break", Keyword::Break),
    (b"continue", Keyword::Continue),
];

/// The keyword of an o-word.
#[cfg(feature = "alloc")]
pub(crate) fn keyword(input: Rest<'_>) -> Read<'_, Keyword> {
    word(&KEYWORDS, input)
}

/// The first of these words that the input begins with.
fn word<'a, T: Copy>(words: &[(&[u8], T)], input: Rest<'a>) -> Read<'a, T> {
    // The first byte decides mostly, without a call.
    let begins = |text: &[u8]| text.first() == input.first() && input.starts_with(text);
    match words.iter().find(|(text, _)| begins(text)) {
        Some((text, found)) => Ok((&input[text.len()..], *found)),
        None => Err(fault_here(ErrorKind::NumberMissing, input)),
    }
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
