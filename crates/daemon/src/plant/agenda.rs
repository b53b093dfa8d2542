//! Faults and repairs to come, by step.

use vocabulary::{ComponentPath, Step, fault::Fault};

use crate::config::Schedule;

/// A fault that begins, or a repair.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ScheduledChange {
    /// The first step that shows it.
    pub(crate) step: Step,
    /// The component.
    pub(crate) component: ComponentPath,
    /// Its fault; `None` repairs it.
    pub(crate) fault: Option<Fault>,
}

/// The changes to come, the next one last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Agenda(Vec<ScheduledChange>);

impl Agenda {
    pub(crate) fn from_schedule(schedule: &Schedule) -> Self {
        let mut agenda = Self::default();
        for fault in &schedule.faults {
            let component = fault.component.clone();
            if let Some(step) = fault.until_step {
                agenda.add(ScheduledChange { step, component: component.clone(), fault: None });
            }
            agenda.add(ScheduledChange {
                step: fault.at_step,
                component,
                fault: Some(fault.fault),
            });
        }
        agenda
    }

    /// Adds a change. At one step repairs come first, and then what was added first.
    pub(crate) fn add(&mut self, item: ScheduledChange) {
        let order = |item: &ScheduledChange| (item.step, item.fault.is_some());
        let place = self.0.partition_point(|other| order(other) > order(&item));
        self.0.insert(place, item);
    }

    /// Takes out the next thing that is due at `step` or was due before.
    pub(crate) fn next_due(&mut self, step: Step) -> Option<ScheduledChange> {
        if self.0.last()?.step <= step { self.0.pop() } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(step: u64, component: &str, fault: Option<Fault>) -> ScheduledChange {
        ScheduledChange { step: Step(step), component: component.parse().unwrap(), fault }
    }

    #[test]
    fn things_come_in_the_order_of_their_steps_repairs_first() {
        let text = r#"
            [[faults]]
            at_step = 20
            component = "m/sensor/g"
            fault = { kind = "zero_output" }
            [[faults]]
            at_step = 10
            until_step = 20
            component = "m/sensor/g"
            fault = { kind = "bias", offset_m = 1e-5 }
        "#;
        let mut agenda = Agenda::from_schedule(&toml::from_str(text).unwrap());
        assert_eq!(agenda.next_due(Step(9)), None);
        let bias = Some(Fault::Bias { offset_m: 1e-5 });
        assert_eq!(agenda.next_due(Step(10)), Some(item(10, "m/sensor/g", bias)));
        assert_eq!(agenda.next_due(Step(19)), None);
        assert_eq!(agenda.next_due(Step(25)), Some(item(20, "m/sensor/g", None)));
        let zero = Some(Fault::ZeroOutput {});
        assert_eq!(agenda.next_due(Step(25)), Some(item(20, "m/sensor/g", zero)));
        assert_eq!(agenda.next_due(Step(99)), None);
    }

    #[test]
    fn of_two_orders_for_one_step_the_later_one_has_the_last_word() {
        let mut agenda = Agenda::default();
        for area_m2 in [1.0, 2.0] {
            let fault = Some(Fault::InternalLeakage { area_m2 });
            agenda.add(item(5, "m/actuator/a", fault));
        }
        let first = agenda.next_due(Step(5)).unwrap();
        assert_eq!(first.fault, Some(Fault::InternalLeakage { area_m2: 1.0 }));
    }
}
