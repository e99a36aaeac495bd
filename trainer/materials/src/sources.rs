//! Several sources of materials, to train on all of them.

use std::collections::HashMap;

use glimpse_core::recipe::Origin;
use serde::Serialize;

use crate::display_with_setting_names;
use crate::error::SourceError;
use crate::setting::{Setting, SettingError, SettingNames};
use crate::{Material, Source};

/// Sources of materials, and how much of training each of them gets.
#[derive(Clone, Debug, PartialEq)]
pub struct Sources {
    sources: Vec<Source>,
    /// One for each source, 1 together; None if all materials count alike.
    shares: Option<Vec<f32>>,
}

/// The materials of one source, which lie in a row, and how often training takes one of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SourceShare {
    /// The source's label.
    pub label: String,
    /// The origin of the materials.
    pub origin: Origin,
    /// How many they are.
    pub materials: usize,
    /// Their share of all tasks that are given ones; those of all source_shares are 1 together.
    pub share: f32,
}

impl SourceShare {
    /// All materials of a source, which training takes alike.
    #[must_use]
    pub fn single(source: &Source, materials: usize) -> Self {
        Self {
            label: source.label().to_owned(),
            origin: match source.is_built_in() {
                true => Origin::BuiltIn,
                false => Origin::Files,
            },
            materials,
            share: 1.0,
        }
    }
}

/// Materials of several sources, and which source_share of them each source is.
pub type MaterialsAndShares = (Vec<Box<dyn Material>>, Vec<SourceShare>);

/// Why sources and shares do not go together.
#[derive(Clone, Debug, PartialEq)]
pub enum ShareError {
    /// There are more or fewer shares than sources.
    Count {
        /// How many sources there are.
        sources: usize,
        /// How many shares.
        shares: usize,
    },
    /// A source of a share of 0 need not be given.
    NotPositive(f32),
}

impl SettingError for ShareError {
    fn message(&self, name: SettingNames) -> String {
        let [share, data] = [Setting::Share, Setting::Materials].map(name);
        match self {
            Self::Count { sources, shares } => {
                format!(
                    "{share} needs one number for each of {data}: {shares} for {sources} of them"
                )
            }
            Self::NotPositive(value) => {
                format!("{share} must be above 0, and not {value}: leave out that one of {data}")
            }
        }
    }
}

display_with_setting_names!(ShareError);
impl std::error::Error for ShareError {}

impl Sources {
    /// Sources in proportion to the numbers given, or, without any, to how many materials each has.
    ///
    /// # Errors
    /// If there is not one positive number for each.
    pub fn new(sources: Vec<Source>, shares: &[f32]) -> Result<Self, ShareError> {
        if let Some(share) = shares
            .iter()
            .find(|share| !(**share > 0.0 && share.is_finite()))
        {
            return Err(ShareError::NotPositive(*share));
        }
        let sum: f32 = shares.iter().sum();
        let shares = match shares {
            [] => None,
            some if some.len() == sources.len() => Some(some.iter().map(|s| s / sum).collect()),
            _ => {
                return Err(ShareError::Count {
                    sources: sources.len(),
                    shares: shares.len(),
                });
            }
        };
        Ok(Self { sources, shares })
    }

    /// All of them.
    #[must_use]
    pub fn as_slice(&self) -> &[Source] {
        &self.sources
    }

    /// Their names, without directories, and their shares, if any were given.
    #[must_use]
    pub fn label(&self) -> String {
        let labels = self.sources.iter().map(Source::label);
        let labels: Vec<String> = match &self.shares {
            None => labels.map(str::to_owned).collect(),
            Some(shares) => {
                let both = labels.zip(shares);
                both.map(|(label, share)| format!("{label} ({share:.3})"))
                    .collect()
            }
        };
        labels.join(" and ")
    }

    /// Reads all of them, one source after the other.
    ///
    /// # Errors
    /// If one cannot be read, or two hold a material of the same name.
    pub fn load(&self) -> Result<MaterialsAndShares, SourceError> {
        let lists = self.sources.iter().map(Source::load);
        self.join(lists.collect::<Result<_, _>>()?)
    }

    /// Joins what each source holds.
    ///
    /// # Errors
    /// If two of them hold a material of the same name.
    pub fn join(
        &self,
        lists: Vec<Vec<Box<dyn Material>>>,
    ) -> Result<MaterialsAndShares, SourceError> {
        let mut holders: HashMap<String, &Source> = HashMap::new();
        for (source, list) in self.sources.iter().zip(&lists) {
            for material in list {
                if let Some(first) = holders.insert(material.name().to_owned(), source) {
                    return Err(SourceError::DuplicateAcrossSources {
                        name: material.name().to_owned(),
                        first: first.to_string(),
                        second: source.to_string(),
                    });
                }
            }
        }
        let counts: Vec<usize> = lists.iter().map(Vec::len).collect();
        let source_shares = self.source_shares(&counts);
        Ok((lists.into_iter().flatten().collect(), source_shares))
    }

    /// The source_share of each source, given the number of its materials.
    #[must_use]
    pub fn source_shares(&self, counts: &[usize]) -> Vec<SourceShare> {
        let total: usize = counts.iter().sum();
        let each = self.sources.iter().zip(counts).enumerate();
        each.map(|(index, (source, count))| SourceShare {
            share: match &self.shares {
                Some(shares) => shares[index],
                None => *count as f32 / total as f32,
            },
            ..SourceShare::single(source, *count)
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sources(texts: &[&str]) -> Vec<Source> {
        texts.iter().map(|text| Source((*text).into())).collect()
    }

    #[test]
    fn shares_are_in_proportion() {
        let given = sources(&["procedural:30:1", "procedural:10:2"]);
        for (shares, expected) in [(&[][..], 0.75), (&[1.0, 3.0][..], 0.25)] {
            let sources = Sources::new(given.clone(), shares).expect("shares are right");
            let (materials, source_shares) = sources.load().expect("names differ");
            assert_eq!(materials.len(), 40);
            assert_eq!(
                [source_shares[0].materials, source_shares[1].materials],
                [30, 10]
            );
            assert_eq!(
                [source_shares[0].share, source_shares[1].share],
                [expected, 1.0 - expected]
            );
        }
        let sources = Sources::new(given, &[1.0, 3.0]).expect("shares are right");
        assert_eq!(
            sources.label(),
            "procedural:30:1 (0.250) and procedural:10:2 (0.750)"
        );
    }

    #[test]
    fn what_does_not_go_together_is_refused() {
        let given = sources(&["procedural:3", "procedural:4"]);
        for shares in [&[1.0][..], &[1.0, 1.0, 1.0], &[1.0, 0.0], &[1.0, f32::NAN]] {
            Sources::new(given.clone(), shares).expect_err("shares are wrong");
        }
        let sources = Sources::new(given, &[]).expect("none are needed");
        let error = sources.load().err().expect("three names are the same");
        assert!(
            matches!(&error, SourceError::DuplicateAcrossSources { name, .. } if name.starts_with("procedural-000")),
            "{error}"
        );
    }
}
