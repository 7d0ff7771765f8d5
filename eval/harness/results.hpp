// Result files and the plots made from them.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "eval/harness/campaign.hpp"

namespace understory::eval::harness {

/// What a result file holds: {"experiment", "config", "rows", "machine": {"cpu", "cores"},
/// "version", "date"}. `rows` is a list of objects; their keys end with the unit, e.g. "rpe_cm".
nlohmann::json result_document(const std::string& experiment, nlohmann::json config,
                               nlohmann::json rows);

/// Writes the file whole or not at all, also behind links. Throws std::runtime_error naming it.
void write_json(const std::filesystem::path& file, const nlohmann::json& json);

/// Errors along the run, final map, truth and figures of run 0 of every cell, for the plots.
nlohmann::json traces_of(const std::vector<CellResult>& cells, const CampaignOptions& options);

/// Where the traces of a result file go: results.json -> results.traces.json; device -> /dev/null.
std::filesystem::path traces_file(const std::filesystem::path& results);

/// Runs eval/plot/SCRIPT with the arguments; false (and a line on stderr) if it failed. Plots are a
/// convenience: results without them are still results.
bool plot(const std::string& script, const std::vector<std::string>& arguments);

}  // namespace understory::eval::harness
