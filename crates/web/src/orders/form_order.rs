//! Reads an order from a form.

use vocabulary::{
    Component, ComponentPath, ModuleName, OperatorName, Order, OrderKind, StructureName,
};

use observer::{OrderOutcome, OrderRequest, order_subject};

use crate::access::Fields;

/// The issuer of orders sent without a certificate; with one, access control identifies the operator.
const PAGE: &str = "web";
/// Most components in one order.
const MOST: usize = 200;

/// An order from a form, before the module's structure is known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FormOrder {
    /// Set only if the page shows several structures.
    pub(super) structure: Option<StructureName>,
    pub(super) module: ModuleName,
    kind: OrderKind,
    order: Order,
}

impl FormOrder {
    /// Reads the fields of a form sent by a user: an order for each component that is named. If `only` names one, as the
    /// button of a row does, that one alone is meant, whatever else is selected.
    ///
    /// # Errors
    /// A message that names the missing or invalid field.
    pub(super) fn read(kind: &str, fields: &Fields, person: &str) -> Result<Vec<Self>, String> {
        let named = fields.filled("only").or_else(|| fields.filled("component"));
        let named: Vec<&str> = named.unwrap_or_default().split_whitespace().collect();
        match named[..] {
            [] => Ok(vec![Self::read_one(kind, fields, "", person)?]),
            _ if named.len() > MOST => Err(format!("more than {MOST} components at once")),
            _ => named.iter().map(|one| Self::read_one(kind, fields, one, person)).collect(),
        }
    }

    fn read_one(
        kind: &str,
        fields: &Fields,
        component: &str,
        person: &str,
    ) -> Result<Self, String> {
        let found = OrderKind::ALL.into_iter().find(|known| known.as_str() == kind);
        let kind = found.ok_or_else(|| {
            let known: Vec<&str> = OrderKind::ALL.iter().map(|kind| kind.as_str()).collect();
            format!(
                "unknown command `{}`; expected one of {}",
                vocabulary::quotation(kind, 64),
                known.join(", ")
            )
        })?;
        // A list names components of several structures with theirs.
        let (structure, component) = match component.split_once('/') {
            Some((structure, path)) if component.matches('/').count() == 3 => {
                (Some(structure), path)
            }
            _ => (fields.filled("structure"), component),
        };
        let structure = structure.map(str::parse).transpose();
        let (module, component) = subject(kind, fields, component)?;
        let order = Order {
            component: component.map(Into::into),
            by: PAGE.to_owned(),
            on_behalf_of: Some(person.to_owned()),
            note: fields.filled("note").map(str::to_owned),
            for_s: if kind.sets_aside() { Some(seconds(fields)?) } else { None },
            force: is_checked(fields, "force")?,
            re_tare: is_checked(fields, "re_tare")?,
        };
        order.check(kind)?;
        Ok(Self { structure: structure.map_err(in_words)?, module, kind, order })
    }

    /// The request to the module in this structure, under the name of the operator in this process's certificate.
    pub(super) fn request(
        self,
        structure: StructureName,
        operator: Option<OperatorName>,
    ) -> OrderRequest {
        let Self { module, kind, mut order, .. } = self;
        if let Some(operator) = &operator {
            order.by = operator.to_string();
        }
        OrderRequest { structure, module, kind, operator, order }
    }

    /// The outcome in words.
    pub(super) fn words(&self, outcome: &OrderOutcome) -> String {
        outcome.words(self.kind, &order_subject(&self.module, &self.order))
    }
}

fn subject(
    kind: OrderKind,
    fields: &Fields,
    component: &str,
) -> Result<(ModuleName, Option<Component>), String> {
    if kind.is_of_module() {
        let module = fields.filled("module").ok_or("`module` is missing; name the module")?;
        return Ok((module.parse().map_err(in_words)?, None));
    }
    if component.is_empty() {
        return Err("`component` is missing; name it as MODULE/sensor/NAME".to_owned());
    }
    let path: ComponentPath = component.parse().map_err(in_words)?;
    Ok((path.module, Some(path.component)))
}

fn seconds(fields: &Fields) -> Result<u64, String> {
    let text = fields.filled("for").ok_or("missing duration: expected e.g. 2h")?;
    let span = humantime::parse_duration(text);
    let wrong = |_| {
        format!(
            "invalid time span `{}`: expected e.g. 2h or 1h 30m",
            vocabulary::quotation(text, 64)
        )
    };
    span.map(|span| span.as_secs()).map_err(wrong)
}

/// Whether a check box is checked: browsers send its field only then.
fn is_checked(fields: &Fields, name: &str) -> Result<bool, String> {
    match fields.get(name).map(String::as_str) {
        None | Some("") => Ok(false),
        Some("on" | "true" | "1") => Ok(true),
        Some(other) => Err(format!(
            "`{name}` is `{}`; use `on`, or leave it out",
            vocabulary::quotation(other, 64)
        )),
    }
}

fn in_words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(kind: &str, fields: &[(&str, &str)]) -> Result<OrderRequest, String> {
        let given = FormOrder::read(kind, &fields.iter().copied().collect(), "Ada Lovelace")?;
        let [given] = <[FormOrder; 1]>::try_from(given).unwrap();
        Ok(given.request("tower".parse().unwrap(), None))
    }

    #[test]
    fn a_form_becomes_an_order_in_the_name_of_a_person() {
        let component = ("component", "module1/sensor/g2");
        let given =
            read("shelve", &[component, ("note", " on site "), ("for", "1h 30m"), ("back", "/")]);
        let given = given.unwrap();
        assert_eq!(
            (given.subject().as_str(), given.module.as_str()),
            ("module1/sensor/g2", "module1")
        );
        let order = given.order;
        assert_eq!((order.for_s, order.note.as_deref()), (Some(5400), Some("on site")));
        assert_eq!(
            (order.by.as_str(), order.on_behalf_of.as_deref()),
            ("web", Some("Ada Lovelace"))
        );
        let reset = read("reset", &[component, ("force", "on")]).unwrap().order;
        assert!(reset.force && !reset.re_tare && reset.for_s.is_none());
        let module = [("module", "module2"), ("note", "painting"), ("for", "2h")];
        assert_eq!(read("suppress", &module).unwrap().subject(), "module2");
    }

    #[test]
    fn several_components_are_several_orders_and_a_rows_button_means_its_own_alone() {
        let several = ("component", "tower/module1/sensor/g2 module2/actuator/a1");
        let read = |fields: &[(&str, &str)]| {
            let read = FormOrder::read("acknowledge", &fields.iter().copied().collect(), "Ada");
            let of = |one: FormOrder| {
                (one.structure.map(|name| name.to_string()), one.module.to_string())
            };
            read.unwrap().into_iter().map(of).collect::<Vec<_>>()
        };
        let tower = || Some("tower".to_owned());
        assert_eq!(
            read(&[several]),
            [(tower(), "module1".to_owned()), (None, "module2".to_owned())]
        );
        let only = ("only", "tower/module2/actuator/a1");
        assert_eq!(read(&[several, only]), [(tower(), "module2".to_owned())]);
    }

    #[test]
    fn what_is_wrong_with_a_form_is_named() {
        let component = ("component", "module1/sensor/g2");
        for (kind, fields, words) in [
            ("explode", vec![component], "unknown command `explode`"),
            ("reset", vec![], "`component` is missing"),
            ("reset", vec![("component", "../../etc")], "names no component"),
            ("reset", vec![("component", "module1/sensor/*")], "not a usable gage name"),
            ("reset", vec![component, ("force", "perhaps")], "`force` is `perhaps`"),
            ("reset", vec![component, ("force", "on"), ("re_tare", "on")], "exclude each other"),
            ("shelve", vec![component, ("note", "x")], "missing duration"),
            ("shelve", vec![component, ("note", "x"), ("for", "soon")], "invalid time span `soon`"),
            ("shelve", vec![component, ("note", "x"), ("for", "90d")], "use 1 to"),
            ("shelve", vec![component, ("for", "2h")], "needs a reason"),
            ("suppress", vec![component], "`module` is missing"),
        ] {
            let error = read(kind, &fields).unwrap_err();
            assert!(error.contains(words), "{kind} {fields:?}: {error}");
        }
    }
}
