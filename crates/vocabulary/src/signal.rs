//! How the columns of tables are named: by component and signal, `module1/actuator/a1/demand_n`.

use crate::ComponentPath;

/// What is measured of a component, or computed for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// Demanded force of an actuator \[N\].
    Demand,
    /// Pressure in chamber A \[Pa\].
    PressureA,
    /// Pressure in chamber B \[Pa\].
    PressureB,
    /// Elongation that a gage measures \[m\].
    Elongation,
    /// What a channel of a learned module reads, in its own unit.
    Reading,
    /// Residual: \[N\] of an actuator, \[m\] of a gage.
    Residual,
    /// Divergence of the residual.
    Divergence,
    /// Elongation that a gage should read \[m\].
    Corrected,
    /// The lower end of the 95 % interval of that \[m\].
    CorrectedLow,
    /// Its upper end \[m\].
    CorrectedHigh,
}

impl Signal {
    /// What a column's name ends with: the quantity and its unit.
    #[must_use]
    pub fn suffix(self) -> &'static str {
        match self {
            Signal::Demand => "demand_n",
            Signal::PressureA => "pressure_a_pa",
            Signal::PressureB => "pressure_b_pa",
            Signal::Elongation => "elongation_m",
            Signal::Reading => "reading",
            Signal::Residual => "residual",
            Signal::Divergence => "divergence",
            Signal::Corrected => "corrected_m",
            Signal::CorrectedLow => "corrected_low_m",
            Signal::CorrectedHigh => "corrected_high_m",
        }
    }

    /// The column of this signal, as tables are written.
    #[must_use]
    pub fn column(self, path: &ComponentPath) -> String {
        format!("{path}/{}", self.suffix())
    }

    /// Finds the column of this signal in a header row and returns its name there.
    ///
    /// A residual may be named by its component alone. If `one_module`, the table is known to be of one module, whose
    /// name may be missing. Programs that require identifiers replace `/` and `-` by `_`; such names are found too.
    #[must_use]
    pub fn find<'a>(
        self,
        header: &'a [String],
        path: &ComponentPath,
        one_module: bool,
    ) -> Option<&'a String> {
        let suffix = self.suffix();
        let mut names = vec![self.column(path)];
        names.extend(one_module.then(|| format!("{}/{suffix}", path.component)));
        if self == Signal::Residual {
            names.push(path.to_string());
            names.extend(one_module.then(|| path.component.to_string()));
        }
        let exact = names.iter().find_map(|name| header.iter().find(|known| *known == name));
        exact.or_else(|| {
            let find = |name: &String| {
                let wanted = identifier(name);
                header.iter().find(|known| identifier(known) == wanted)
            };
            names.iter().find_map(find)
        })
    }
}

fn identifier(name: &str) -> String {
    name.replace(['/', '-'], "_")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(names: &[&str]) -> Vec<String> {
        names.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_column_is_found_by_every_name_that_it_may_have() {
        let gage: ComponentPath = "m-1/sensor/g-5".parse().unwrap();
        assert_eq!(Signal::Elongation.column(&gage), "m-1/sensor/g-5/elongation_m");
        for (signal, name, one_module) in [
            (Signal::Elongation, "m-1/sensor/g-5/elongation_m", false),
            (Signal::Elongation, "sensor/g-5/elongation_m", true),
            (Signal::Elongation, "m_1_sensor_g_5_elongation_m", false),
            (Signal::Elongation, "sensor_g_5_elongation_m", true),
            (Signal::Residual, "m-1/sensor/g-5/residual", false),
            (Signal::Residual, "m-1/sensor/g-5", false),
            (Signal::Residual, "sensor/g-5", true),
        ] {
            let header = header(&["step", "m-2/sensor/g-5/residual", name]);
            assert_eq!(signal.find(&header, &gage, one_module).unwrap(), name);
        }
        let other = header(&["sensor/g-5/elongation_m", "m-1/sensor/g-5"]);
        assert_eq!(Signal::Elongation.find(&other, &gage, false), None, "of which module?");
        assert_eq!(Signal::Demand.find(&other, &gage, true), None);
    }

    #[test]
    fn the_exact_name_goes_before_one_like_it() {
        let gage: ComponentPath = "m/sensor/g-1".parse().unwrap();
        let header = header(&["m/sensor/g_1/residual", "m/sensor/g-1/residual"]);
        assert_eq!(Signal::Residual.find(&header, &gage, false).unwrap(), &header[1]);
    }
}
