//! Name of this machine's processor.

/// Model of the processor, if the system reports it without running a program.
pub fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    model(&text).unwrap_or_else(|| format!("unknown {} processor", std::env::consts::ARCH))
}

/// First model in `/proc/cpuinfo`, with the numbers of its generation: hypervisors shorten the name.
fn model(cpuinfo: &str) -> Option<String> {
    let field = |name: &str| {
        let mut fields = cpuinfo.lines().filter_map(|line| line.split_once(':'));
        fields.find(|(key, _)| key.trim() == name).map(|(_, value)| value.trim()).filter(|v| !v.is_empty())
    };
    // On other architectures the line has another name, or is missing.
    let name = field("model name").or_else(|| field("Model")).or_else(|| field("cpu"))?;
    match (field("cpu family"), field("model")) {
        (Some(family), Some(number)) => Some(format!("{name} (family {family}, model {number})")),
        _ => Some(name.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_is_read_where_there_is_one() {
        let x86 = "processor\t: 0\nvendor_id\t: AuthenticAMD\ncpu family\t: 25\nmodel\t\t: 17\nmodel \
                   name\t: AMD EPYC\n";
        assert_eq!(model(x86).unwrap(), "AMD EPYC (family 25, model 17)");
        assert_eq!(model("processor : 0\nModel\t: Raspberry Pi 4\n").unwrap(), "Raspberry Pi 4");
        assert_eq!(model("processor : 0\nCPU part : 0xd0c\n"), None);
        assert_eq!(model(""), None);
    }
}
