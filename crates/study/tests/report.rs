//! The report: self-contained, and whatever it is given shows as it is.

use study::report::{ReportFigure, StudyReport, Table, html};

fn report() -> StudyReport {
    StudyReport {
        title: "Study of <tower> & \"co\"".into(),
        paragraphs: vec!["D < γ & so on".into()],
        tables: vec![Table {
            title: "Delays".into(),
            note: "<script>alert(1)</script>".into(),
            heading: vec!["fault".into(), "median [ms]".into()],
            rows: vec![
                vec!["bias".into(), "0".into()],
                vec!["1 < 2".into(), "−3.5 ± 1".into()],
                vec!["walk".into(), "–".into()],
            ],
        }],
        figures: vec![ReportFigure {
            name: "figure",
            caption: "A & B".into(),
            svg: "<?xml version=\"1.0\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\"/>\n".into(),
        }],
    }
}

#[test]
fn text_is_escaped_and_figures_are_not() {
    let page = html(&report());
    assert!(page.contains("Study of &lt;tower&gt; &amp; &quot;co&quot;"));
    assert!(page.contains("D &lt; γ &amp; so on"));
    assert!(page.contains("&lt;script&gt;") && !page.contains("<script"));
    assert!(page.contains("<svg xmlns=\"http://www.w3.org/2000/svg\"/>"));
    assert!(!page.contains("<?xml"));
}

#[test]
fn the_page_is_well_formed_and_needs_nothing_from_elsewhere() {
    let page = html(&report());
    assert!(page.starts_with("<!DOCTYPE html>\n"));
    for link in ["src=", "href=", "url(", "@import"] {
        assert!(!page.contains(link), "{link}");
    }
    // All but the void elements of the head is XML too.
    let body = &page[page.find("<body>").unwrap()..page.find("</html>").unwrap()];
    let document = roxmltree::Document::parse(body).unwrap();
    let rows = document.descendants().filter(|node| node.has_tag_name("tr"));
    assert!(rows.clone().all(|row| row.children().filter(|n| n.is_element()).count() == 2));
    assert_eq!(rows.count(), 4);
}

#[test]
fn columns_of_numbers_are_set_flush_right() {
    let page = html(&report());
    assert!(page.contains("<th scope=\"col\">fault</th>"));
    assert!(page.contains("<th scope=\"col\" class=\"number\">median [ms]</th>"));
    assert!(page.contains("<td class=\"number\">−3.5 ± 1</td>"));
}

#[test]
fn an_empty_report_is_a_page() {
    assert!(html(&StudyReport::default()).ends_with("</html>\n"));
}
