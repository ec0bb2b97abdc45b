//! `docs/errors.md` is the catalogue of the core, complete, and every error tells why and what to do.
//!
//! `PENTASPLINE_BLESS=1 cargo test -p whole-product-tests --test errors_doc` writes the page anew.

use std::collections::BTreeSet;
use std::path::PathBuf;

use host_sim::commands::errors::{markdown, STAGES};
use pentaspline::catalogue::entries;

#[test]
fn the_page_says_what_the_catalogue_says() {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/errors.md");
    let now = markdown();
    if std::env::var_os("PENTASPLINE_BLESS").is_some() {
        std::fs::write(&file, &now).expect("the page is written");
    }
    let page = std::fs::read_to_string(&file).unwrap_or_default();
    for (number, (was, is)) in (1..).zip(page.lines().zip(now.lines())) {
        assert_eq!(was, is, "docs/errors.md:{number} is stale");
    }
    assert_eq!(
        page.lines().count(),
        now.lines().count(),
        "rows of docs/errors.md"
    );
}

#[test]
fn every_error_has_a_message_a_reason_and_a_mend() {
    let empty: Vec<u16> = entries()
        .filter(|e| {
            [e.message.text, e.reason, e.mend]
                .iter()
                .any(|t| t.trim().is_empty())
        })
        .map(|e| e.message.code)
        .collect();
    assert!(empty.is_empty(), "without reason or mend: {empty:?}");
}

#[test]
fn no_number_means_two_things() {
    let mut seen = BTreeSet::new();
    for entry in entries() {
        assert!(
            seen.insert(entry.message.code),
            "error:{} is there twice",
            entry.message.code
        );
    }
}

#[test]
fn every_number_belongs_to_one_stage() {
    for entry in entries() {
        let code = entry.message.code;
        let owners = STAGES.iter().filter(|&&(_, a, b)| (a..=b).contains(&code));
        assert_eq!(owners.count(), 1, "error:{code}");
    }
}
