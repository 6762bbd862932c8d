//! The direction between the crates, and the licences of what they depend on.

use anyhow::{Context, Result, bail};
use serde::Deserialize;

use crate::shell::{cargo, output, run};

/// Each crate of the workspace with those it may depend on. Data flows from the first to the last.
const DIRECTION: [(&str, &[&str]); 10] = [
    ("modiste-core", &[]),
    ("modiste-io", &["modiste-core"]),
    ("modiste-body", &["modiste-core", "modiste-io"]),
    ("modiste-cloth", &["modiste-core", "modiste-io", "modiste-body"]),
    ("modiste-garment", &["modiste-core", "modiste-io", "modiste-body", "modiste-cloth"]),
    ("modiste-hair", &["modiste-core", "modiste-io", "modiste-body"]),
    (
        "modiste-scene",
        &["modiste-core", "modiste-io", "modiste-body", "modiste-cloth", "modiste-garment", "modiste-hair"],
    ),
    (
        "modiste",
        &[
            "modiste-core",
            "modiste-io",
            "modiste-body",
            "modiste-cloth",
            "modiste-garment",
            "modiste-hair",
            "modiste-scene",
        ],
    ),
    ("modiste-cli", &["modiste", "modiste-core"]),
    (
        "xtask",
        &[
            "modiste-core",
            "modiste-io",
            "modiste-body",
            "modiste-cloth",
            "modiste-garment",
            "modiste-hair",
            "modiste-scene",
            "modiste",
        ],
    ),
];

/// Licences (SPDX) that combine with Apache-2.0 OR MIT without further duties than naming them.
const ALLOWED_LICENCES: [&str; 10] = [
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "MIT",
    "MIT-0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Crates that only one crate may use, with the reason.
const RESERVED: [(&str, &str, &str); 2] = [
    ("faer", "modiste-core", "its generic code is compiled once there"),
    ("clap", "modiste-cli xtask", "libraries know no command line"),
];

#[derive(Debug, Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    workspace_members: Vec<String>,
}

#[derive(Debug, Deserialize)]
struct Package {
    name: String,
    version: String,
    id: String,
    license: Option<String>,
    dependencies: Vec<Dependency>,
}

#[derive(Debug, Deserialize)]
struct Dependency {
    name: String,
    kind: Option<String>,
}

/// Checks the workspace.
pub(crate) fn check() -> Result<()> {
    let metadata = metadata()?;
    let mut faults = Vec::new();
    let members: Vec<&Package> =
        metadata.packages.iter().filter(|package| metadata.workspace_members.contains(&package.id)).collect();
    for package in &members {
        faults.extend(direction_faults(package));
    }
    for package in &metadata.packages {
        let licence = package.license.as_deref().unwrap_or("none");
        if !is_allowed(licence) {
            faults.push(format!("{} {} has the licence {licence}", package.name, package.version));
        }
    }
    if faults.is_empty() {
        println!("\ndependencies: {} crates in their order, {} licences fine", members.len(), metadata.packages.len());
        return Ok(());
    }
    bail!("{}", faults.join("; "))
}

/// What cargo resolves for this machine; falls back on nothing, but needs no network once everything is fetched.
fn metadata() -> Result<Metadata> {
    let version = output(std::process::Command::new("rustc").arg("-vV"))?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).context("`rustc -vV` names no host")?;
    let words = ["metadata", "--format-version", "1", "--locked", "--filter-platform", host];
    let text = output(&mut cargo(&words)).or_else(|_| {
        run(&mut cargo(&["fetch", "--locked", "--target", host]))?;
        output(&mut cargo(&words))
    })?;
    serde_json::from_str(&text).context("`cargo metadata` printed another form than expected")
}

fn direction_faults(package: &Package) -> Vec<String> {
    let Some((_, allowed)) = DIRECTION.iter().find(|(name, _)| *name == package.name) else {
        return vec![format!("{} has no place in the direction of the crates", package.name)];
    };
    let mut faults = Vec::new();
    for dependency in package.dependencies.iter().filter(|dependency| dependency.kind.as_deref() != Some("dev")) {
        let ours = DIRECTION.iter().any(|(name, _)| *name == dependency.name);
        if ours && !allowed.contains(&dependency.name.as_str()) {
            faults.push(format!("{} must not depend on {}", package.name, dependency.name));
        }
        if let Some((_, users, why)) = RESERVED.iter().find(|(name, _, _)| *name == dependency.name)
            && !users.split(' ').any(|user| user == package.name)
        {
            faults.push(format!("{} must not depend on {}: {why}", package.name, dependency.name));
        }
    }
    faults
}

/// Whether an SPDX expression can be met with the allowed licences.
fn is_allowed(expression: &str) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    any_of(&words, &mut at) && at == words.len()
}

/// `a OR b OR …`, the weakest binding.
fn any_of(words: &[&str], at: &mut usize) -> bool {
    let mut met = all_of(words, at);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        met |= all_of(words, at);
    }
    met
}

/// `a AND b AND …`.
fn all_of(words: &[&str], at: &mut usize) -> bool {
    let mut met = licence(words, at);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        met &= licence(words, at);
    }
    met
}

/// A name, a name `WITH` an exception, or an expression in brackets.
fn licence(words: &[&str], at: &mut usize) -> bool {
    match words.get(*at) {
        None => false,
        Some(&"(") => {
            *at += 1;
            let met = any_of(words, at);
            *at += 1;
            met
        }
        Some(&name) => {
            *at += 1;
            let mut full = name.to_owned();
            if words.get(*at) == Some(&"WITH") {
                full = [name, "WITH", words.get(*at + 1).copied().unwrap_or("")].join(" ");
                *at += 2;
            }
            ALLOWED_LICENCES.contains(&full.as_str())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Dependency, Package, direction_faults, is_allowed};

    #[test]
    fn licence_expressions_are_met_or_not() {
        for fine in ["MIT", "MIT/Apache-2.0", "(MIT OR Apache-2.0) AND Unicode-3.0", "GPL-3.0 OR Zlib"] {
            assert!(is_allowed(fine), "{fine}");
        }
        assert!(is_allowed("Apache-2.0 WITH LLVM-exception OR MPL-2.0"));
        for bad in ["GPL-3.0", "MIT AND GPL-3.0", "none", "", "MIT MIT", "(GPL-3.0 OR LGPL-3.0) AND MIT"] {
            assert!(!is_allowed(bad), "{bad}");
        }
    }

    #[test]
    fn arrows_against_the_direction_are_named() {
        let dependency = |name: &str, kind: Option<&str>| Dependency { name: name.into(), kind: kind.map(Into::into) };
        let package = |name: &str, dependencies| Package {
            name: name.into(),
            version: "0.1.0".into(),
            id: String::new(),
            license: None,
            dependencies,
        };
        let fine =
            package("modiste-io", vec![dependency("modiste-core", None), dependency("modiste-body", Some("dev"))]);
        assert!(direction_faults(&fine).is_empty());
        let wrong = package("modiste-io", vec![dependency("modiste-body", None), dependency("clap", None)]);
        let faults = direction_faults(&wrong);
        assert_eq!(faults.len(), 2);
        assert!(faults[0].contains("modiste-io must not depend on modiste-body"));
        assert_eq!(direction_faults(&package("modiste-other", vec![])).len(), 1);
    }
}
