// `understory import pcap`: a laser's captured packets into a log.
#pragma once

#include <CLI/CLI.hpp>

namespace understory::cli {

/// Adds pcap.
void add_packet_import(CLI::App& import);

}  // namespace understory::cli
