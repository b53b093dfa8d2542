//! Writes metrics in the text format of OpenMetrics.

use std::borrow::Cow;
use std::fmt;

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{
    DescriptorEncoder, EncodeCounterValue, EncodeGaugeValue, EncodeMetric, MetricEncoder, text,
};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::{Registry, Unit};

/// The encoder for metrics.
pub struct Sheet<'a>(DescriptorEncoder<'a>);

/// Renders all metrics; every line gets these labels.
pub fn render(
    labels: Vec<(&'static str, String)>,
    write: impl Fn(&mut Sheet<'_>) -> fmt::Result + Send + Sync + 'static,
) -> Result<String, fmt::Error> {
    let labels = labels.into_iter().map(|(name, value)| (Cow::from(name), Cow::from(value)));
    let mut registry = Registry::with_labels(labels);
    registry.register_collector(Box::new(MetricsCollector(write)));
    let mut text = String::new();
    text::encode(&mut text, &registry)?;
    Ok(text)
}

/// Passes the library's encoder to a function.
struct MetricsCollector<F>(F);

impl<F> fmt::Debug for MetricsCollector<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("MetricsCollector")
    }
}

impl<F> Collector for MetricsCollector<F>
where
    F: Fn(&mut Sheet<'_>) -> fmt::Result + Send + Sync + 'static,
{
    fn encode(&self, encoder: DescriptorEncoder<'_>) -> fmt::Result {
        (self.0)(&mut Sheet(encoder))
    }
}

impl Sheet<'_> {
    /// A gauge.
    pub fn gauge(&mut self, name: &str, help: &str, value: impl EncodeGaugeValue) -> fmt::Result {
        self.0.encode_descriptor(name, help, None, MetricType::Gauge)?.encode_gauge(&value)
    }

    /// A gauge of a size \[bytes\].
    pub fn bytes(&mut self, name: &str, help: &str, bytes: u64) -> fmt::Result {
        let unit = Some(&Unit::Bytes);
        self.0.encode_descriptor(name, help, unit, MetricType::Gauge)?.encode_gauge(&bytes)
    }

    /// A gauge of a time \[s\]; omitted while the value is missing.
    pub fn seconds(&mut self, name: &str, help: &str, time_s: Option<f64>) -> fmt::Result {
        let Some(time_s) = time_s.filter(|time_s| time_s.is_finite()) else { return Ok(()) };
        let unit = Some(&Unit::Seconds);
        self.0.encode_descriptor(name, help, unit, MetricType::Gauge)?.encode_gauge(&time_s)
    }

    /// When the first of the process's certificates expires \[s since 1970\]; omitted without one.
    pub fn certificate_expiry(&mut self, until_unix_s: Option<u64>) -> fmt::Result {
        let help = "End of the certificate that the process shows on the network.";
        #[expect(clippy::cast_precision_loss, reason = "seconds since 1970")]
        let until_s = until_unix_s.map(|until| until as f64);
        self.seconds("trusswatch_certificate_expiry_timestamp", help, until_s)
    }

    /// A counter, which starts at 0 with the process.
    pub fn counter(&mut self, name: &str, help: &str, count: u64) -> fmt::Result {
        let encoder = self.0.encode_descriptor(name, help, None, MetricType::Counter)?;
        ConstCounter::new(count).encode(encoder)
    }

    /// A counter of seconds, which starts at 0 with the process \[s\].
    pub fn counted_seconds(&mut self, name: &str, help: &str, time_s: f64) -> fmt::Result {
        let unit = Some(&Unit::Seconds);
        let encoder = self.0.encode_descriptor(name, help, unit, MetricType::Counter)?;
        ConstCounter::new(time_s).encode(encoder)
    }

    /// Constant text about the process.
    pub fn info(&mut self, name: &str, help: &str, label: (&str, &str)) -> fmt::Result {
        self.0.encode_descriptor(name, help, None, MetricType::Info)?.encode_info(&[label])
    }

    /// A gauge for each value of a label.
    pub fn gauges<'l, V: EncodeGaugeValue>(
        &mut self,
        name: &str,
        help: &str,
        label: &str,
        values: impl IntoIterator<Item = (Cow<'l, str>, V)>,
    ) -> fmt::Result
    where
        ConstGauge<V>: EncodeMetric,
    {
        let mut family = self.0.encode_descriptor(name, help, None, MetricType::Gauge)?;
        for (of, value) in values {
            family.encode_family(&[(label, of)])?.encode_gauge(&value)?;
        }
        Ok(())
    }

    /// A gauge for each pair of values of two labels.
    pub fn gauges_of_two<V: EncodeGaugeValue>(
        &mut self,
        name: &str,
        help: &str,
        labels: [&str; 2],
        values: impl IntoIterator<Item = ([String; 2], V)>,
    ) -> fmt::Result
    where
        ConstGauge<V>: EncodeMetric,
    {
        let mut family = self.0.encode_descriptor(name, help, None, MetricType::Gauge)?;
        for ([first, second], value) in values {
            let labels = [(labels[0], first), (labels[1], second)];
            family.encode_family(&labels)?.encode_gauge(&value)?;
        }
        Ok(())
    }

    /// A time \[s\] for each pair of values of two labels.
    pub fn seconds_of_two(
        &mut self,
        name: &str,
        help: &str,
        labels: [&str; 2],
        values: impl IntoIterator<Item = ([String; 2], f64)>,
    ) -> fmt::Result {
        let unit = Some(&Unit::Seconds);
        let mut family = self.0.encode_descriptor(name, help, unit, MetricType::Gauge)?;
        for ([first, second], time_s) in values {
            let labels = [(labels[0], first), (labels[1], second)];
            family.encode_family(&labels)?.encode_gauge(&time_s)?;
        }
        Ok(())
    }

    /// A counter for each value of a label.
    pub fn counters<'l>(
        &mut self,
        name: &str,
        help: &str,
        label: &str,
        counts: impl IntoIterator<Item = (&'l str, u64)>,
    ) -> fmt::Result {
        let mut family = self.0.encode_descriptor(name, help, None, MetricType::Counter)?;
        for (of, count) in counts {
            write_count(&mut family, &[(label, of)], count)?;
        }
        Ok(())
    }

    /// A counter for each pair of values of two labels.
    pub fn counters_of_two<'l>(
        &mut self,
        name: &str,
        help: &str,
        labels: [&str; 2],
        counts: impl IntoIterator<Item = ([&'l str; 2], u64)>,
    ) -> fmt::Result {
        let mut family = self.0.encode_descriptor(name, help, None, MetricType::Counter)?;
        for ([first, second], count) in counts {
            write_count(&mut family, &[(labels[0], first), (labels[1], second)], count)?;
        }
        Ok(())
    }
}

fn write_count<const N: usize>(
    family: &mut MetricEncoder<'_>,
    labels: &[(&str, &str); N],
    count: u64,
) -> fmt::Result
where
    u64: EncodeCounterValue,
{
    ConstCounter::new(count).encode(family.encode_family(labels)?)
}
