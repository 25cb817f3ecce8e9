//! A source file with all its mutants built in.
//!
//! A mutant is what cargo-mutants makes of the text, not of the syntax: after `a - b + c` has become `a / b + c` it is parsed anew. So every
//! operator expression, taken as far as operators reach, becomes a `match` whose arms are the expression itself and each of its mutants
//! whole: `(match chosen(7, 2) { 0 => a - b, 1 => a + b, _ => a / b })`. Within the first arm smaller expressions are treated likewise.

use std::cmp::Reverse;
use std::collections::{BTreeMap, HashSet};
use std::iter::once;
use std::ops::Range;

use quote::ToTokens;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{BinOp, Block, Expr, Signature};

use crate::mutant::{Genre, Lines, Mutant};

/// How mutants that need not be tried, or cannot be built in, end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Left {
    /// Does not compile.
    Unviable,
    /// The place is worked out when it is compiled, or its type does not let two values stand side by side.
    NotBuiltIn,
}

/// A file with its mutants, each of which is known by its place in the list; and where they stand.
pub struct Schemata {
    pub text: String,
    /// Which mutant a line of the text is, from line 1.
    pub mutant_of_line: BTreeMap<usize, usize>,
    /// Places of which the text asks what is chosen there.
    pub sites: Vec<Built>,
    /// Those that are not in the text for reasons found here.
    pub left: Vec<(usize, Left)>,
}

/// A place with mutants.
pub struct Built {
    pub lines: Range<usize>,
    /// The number by which the first of them is chosen; the others follow.
    pub first: usize,
    pub mutants: Vec<usize>,
}

/// Puts the mutants of one file into it but for those of `without`; functions of the names in `constants` stay `const`. The mutants are
/// chosen by numbers from `first` on.
pub fn of_file(
    source: &str,
    mutants: &[(usize, &Mutant)],
    without: &HashSet<usize>,
    constants: &HashSet<String>,
    first: usize,
) -> syn::Result<Schemata> {
    let lines = Lines::of(source);
    let mut finder = Finder { lines: &lines, constants, places: Vec::new(), deleted: Vec::new() };
    finder.visit_file(&syn::parse_file(source)?);
    let Finder { places, deleted, .. } = finder;

    // In the order of the text; what is put between two characters comes first, of expressions that begin together the longest.
    let order = |range: &Range<usize>| (range.start, !range.is_empty(), Reverse(range.end));
    let mut sites: BTreeMap<_, (Range<usize>, Site)> = BTreeMap::new();
    let mut left = Vec::new();
    for &(number, mutant) in mutants {
        let span = lines.range(mutant.span);
        let Some(place) =
            places.iter().find(|place| place.genres.contains(&mutant.genre) && place.spans.contains(&span))
        else {
            left.push((number, Left::NotBuiltIn));
            continue;
        };
        let choice = match place.form {
            Form::Expression => {
                let whole = &place.range;
                let text = format!(
                    "{} {} {}",
                    &source[whole.start..span.start],
                    mutant.replacement,
                    &source[span.end..whole.end]
                );
                // On one line and without comments, so that an error's line tells the mutant.
                syn::parse_str::<Expr>(&text).map(|expression| expression.to_token_stream().to_string()).ok()
            }
            Form::Body | Form::Arm => Some(mutant.replacement.clone()),
        };
        let site = &mut sites
            .entry(order(&place.range))
            .or_insert_with(|| (place.range.clone(), Site { form: place.form, choices: Vec::new() }))
            .1;
        if choice.is_none() {
            left.push((number, Left::Unviable));
        }
        site.choices.push((number, choice.filter(|_| !without.contains(&number))));
    }
    for range in deleted {
        sites.insert(order(&range), (range, Site { form: Form::Arm, choices: Vec::new() }));
    }

    let mut writer = Writer {
        source,
        text: String::new(),
        line: 1,
        next: first,
        mutant_of_line: BTreeMap::new(),
        sites: Vec::new(),
    };
    let sites: Vec<_> = sites.into_values().collect();
    writer.write(0..source.len(), &sites);
    Ok(Schemata { text: writer.text, mutant_of_line: writer.mutant_of_line, sites: writer.sites, left })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// Of the expression one of several is chosen.
    Expression,
    /// At the beginning of a function's body it may return at once.
    Body,
    /// After an arm's pattern a guard is put; without mutants the text is left out.
    Arm,
}

/// Where mutants may be built in.
struct Place {
    range: Range<usize>,
    form: Form,
    genres: &'static [Genre],
    /// What cargo-mutants replaces there.
    spans: Vec<Range<usize>>,
}

struct Site {
    form: Form,
    /// Numbers of mutants, and their text where they are built in.
    choices: Vec<(usize, Option<String>)>,
}

struct Finder<'f> {
    lines: &'f Lines<'f>,
    constants: &'f HashSet<String>,
    places: Vec<Place>,
    /// `const` before functions.
    deleted: Vec<Range<usize>>,
}

const OPERATORS: &[Genre] = &[Genre::BinaryOperator, Genre::UnaryOperator];

impl Finder<'_> {
    fn range(&self, spanned: &impl Spanned) -> Range<usize> {
        let (start, end) = (spanned.span().start(), spanned.span().end());
        self.lines.offset(start.line, start.column)..self.lines.offset(end.line, end.column)
    }

    fn place(&mut self, range: Range<usize>, form: Form, genres: &'static [Genre], spans: Vec<Range<usize>>) {
        self.places.push(Place { range, form, genres, spans });
    }

    /// The operators of an expression as far as they reach; what is within their operands is visited.
    fn operators(&mut self, expression: &Expr, spans: &mut Vec<Range<usize>>) {
        match expression {
            Expr::Binary(binary) => {
                self.operators(&binary.left, spans);
                spans.push(self.range(&binary.op));
                self.operators(&binary.right, spans);
            }
            Expr::Unary(unary) => {
                spans.push(self.range(&unary.op));
                self.operators(&unary.expr, spans);
            }
            Expr::Cast(cast) => self.operators(&cast.expr, spans),
            other => self.visit_expr(other),
        }
    }

    /// Whether its body is to be visited: what is worked out when it is compiled can choose nothing.
    fn enter(&mut self, signature: &Signature, body: &Block) -> bool {
        if let Some(constant) = &signature.constness {
            if self.constants.contains(&signature.ident.to_string()) {
                return false;
            }
            let range = self.range(constant);
            self.deleted.push(range);
        }
        let is_opaque =
            matches!(&signature.output, syn::ReturnType::Type(_, kind) if matches!(**kind, syn::Type::ImplTrait(_)));
        if let (Some(first), Some(last), false) = (body.stmts.first(), body.stmts.last(), is_opaque) {
            let (first, last) = (self.range(first), self.range(last));
            self.place(first.start..first.start, Form::Body, &[Genre::FnValue], once(first.start..last.end).collect());
        }
        true
    }
}

fn has_let(expression: &Expr) -> bool {
    match expression {
        Expr::Let(_) => true,
        Expr::Binary(binary) if matches!(binary.op, BinOp::And(_)) => has_let(&binary.left) || has_let(&binary.right),
        _ => false,
    }
}

impl<'ast> Visit<'ast> for Finder<'_> {
    fn visit_expr(&mut self, expression: &'ast Expr) {
        match expression {
            // A chain of conditions that bind names cannot stand in an arm; each of its other conditions can.
            Expr::Binary(binary) if has_let(expression) => {
                self.visit_expr(&binary.left);
                self.visit_expr(&binary.right);
            }
            Expr::Binary(_) | Expr::Unary(_) | Expr::Cast(_) => {
                let mut spans = Vec::new();
                self.operators(expression, &mut spans);
                let range = self.range(expression);
                self.place(range, Form::Expression, OPERATORS, spans);
            }
            Expr::Const(_) => {}
            other => visit::visit_expr(self, other),
        }
    }

    fn visit_expr_struct(&mut self, literal: &'ast syn::ExprStruct) {
        if literal.rest.is_some() {
            let spans = literal.fields.pairs().map(|pair| {
                self.range(pair.value()).start
                    ..pair.punct().map_or(self.range(pair.value()).end, |comma| self.range(comma).end)
            });
            let spans = spans.collect();
            let range = self.range(literal);
            self.place(range, Form::Expression, &[Genre::StructField], spans);
        }
        visit::visit_expr_struct(self, literal);
    }

    fn visit_expr_match(&mut self, matching: &'ast syn::ExprMatch) {
        self.visit_expr(&matching.expr);
        // Where none takes the rest without a condition, no other can have one put to it.
        let has_rest = matching.arms.iter().any(|arm| matches!(arm.pat, syn::Pat::Wild(_)) && arm.guard.is_none());
        for arm in &matching.arms {
            if let Some((_, guard)) = &arm.guard {
                if !has_let(guard) {
                    let range = self.range(guard);
                    self.place(range.clone(), Form::Expression, &[Genre::MatchArmGuard], once(range).collect());
                }
                self.visit_expr(guard);
            } else if has_rest {
                let end = self.range(&arm.pat).end;
                self.place(end..end, Form::Arm, &[Genre::MatchArm], once(self.range(arm)).collect());
            }
            self.visit_expr(&arm.body);
        }
    }

    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        if self.enter(&function.sig, &function.block) {
            self.visit_block(&function.block);
        }
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        if self.enter(&function.sig, &function.block) {
            self.visit_block(&function.block);
        }
    }

    fn visit_trait_item_fn(&mut self, function: &'ast syn::TraitItemFn) {
        if let Some(body) = &function.default
            && self.enter(&function.sig, body)
        {
            self.visit_block(body);
        }
    }

    // What is worked out when it is compiled.
    fn visit_item_const(&mut self, _: &'ast syn::ItemConst) {}
    fn visit_impl_item_const(&mut self, _: &'ast syn::ImplItemConst) {}
    fn visit_trait_item_const(&mut self, _: &'ast syn::TraitItemConst) {}
    fn visit_item_static(&mut self, _: &'ast syn::ItemStatic) {}
    fn visit_type(&mut self, _: &'ast syn::Type) {}
    fn visit_pat(&mut self, _: &'ast syn::Pat) {}
    fn visit_generics(&mut self, _: &'ast syn::Generics) {}
    fn visit_expr_repeat(&mut self, repeat: &'ast syn::ExprRepeat) {
        self.visit_expr(&repeat.expr);
    }
}

struct Writer<'w> {
    source: &'w str,
    text: String,
    line: usize,
    /// The number by which the next mutant is chosen.
    next: usize,
    mutant_of_line: BTreeMap<usize, usize>,
    sites: Vec<Built>,
}

impl Writer<'_> {
    fn push(&mut self, text: &str) {
        self.line += text.matches('\n').count();
        self.text.push_str(text);
    }

    /// A mutant on a line of its own.
    fn push_mutant(&mut self, mutant: usize, text: &str) {
        self.push("\n");
        self.mutant_of_line.insert(self.line, mutant);
        self.push(text);
    }

    /// The source of a range, with the sites that lie in it, which are in order, those within others after these.
    fn write(&mut self, range: Range<usize>, sites: &[(Range<usize>, Site)]) {
        let mut at = range.start;
        let mut rest = sites;
        while let Some(((place, site), after)) = rest.split_first() {
            // Those within this one.
            let inner = after.iter().take_while(|(inner, _)| inner.start < place.end).count();
            let (inner, after) = after.split_at(inner);
            self.push(&self.source[at..place.start]);
            self.write_site(place.clone(), site, inner);
            (at, rest) = (place.end, after);
        }
        self.push(&self.source[at..range.end]);
    }

    fn write_site(&mut self, place: Range<usize>, site: &Site, inner: &[(Range<usize>, Site)]) {
        let (line, first) = (self.line, self.next);
        self.next += site.choices.len();
        let built =
            || site.choices.iter().enumerate().filter_map(|(at, (mutant, text))| Some((at, *mutant, text.as_ref()?)));
        match site.form {
            Form::Body => {
                for (at, mutant, text) in built() {
                    self.push_mutant(
                        mutant,
                        &format!("if crate::mutants::choice({}, 1) == 1 {{ return {text}; }}", first + at),
                    );
                }
                self.push("\n");
            }
            Form::Arm => {
                for (at, mutant, _) in built() {
                    self.push_mutant(mutant, &format!("if crate::mutants::choice({}, 1) == 0\n", first + at));
                }
            }
            Form::Expression if built().next().is_none() => self.write(place, inner),
            Form::Expression => {
                self.push(&format!("(match crate::mutants::choice({first}, {}) {{ 0 => ", site.choices.len()));
                self.write(place, inner);
                self.push(",");
                for (at, mutant, text) in built() {
                    self.push_mutant(mutant, &format!("{} => {text},", at + 1));
                }
                self.push("\n_ => unreachable!() })");
            }
        }
        let mutants = site.choices.iter().map(|&(mutant, _)| mutant).collect();
        self.sites.push(Built { lines: line..self.line + 1, first, mutants });
    }
}
