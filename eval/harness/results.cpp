#include "eval/harness/results.hpp"

#include <fmt/format.h>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/io/output_file.hpp"
#include "common/terminal/run_program.hpp"
#include "eval/tools/machine.hpp"

namespace understory::eval::harness {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> plot_script(const std::string& script) {
  std::error_code ignored;
  const fs::path executable = fs::read_symlink("/proc/self/exe", ignored);
  for (const fs::path& folder : {executable.parent_path().parent_path() / UNDERSTORY_PLOT_INSTALLED,
                                 fs::path(UNDERSTORY_PLOT_SOURCE)}) {
    if (fs::exists(folder / script, ignored)) return folder / script;
  }
  return std::nullopt;
}

}  // namespace

nlohmann::json result_document(const std::string& experiment, nlohmann::json config,
                               nlohmann::json rows) {
  const tools::Machine machine = tools::this_machine();
  return {
      {"experiment", experiment},    {"config", std::move(config)},
      {"rows", std::move(rows)},     {"machine", {{"cpu", machine.cpu}, {"cores", machine.cores}}},
      {"version", tools::version()}, {"date", tools::today()}};
}

void write_json(const fs::path& file, const nlohmann::json& json) {
  // A log or a map that --json names by mistake is not lost.
  std::error_code failed;
  if (fs::is_regular_file(file, failed)) {
    const int first = std::ifstream(file).peek();
    if (first != std::char_traits<char>::eof() && first != '{' && first != '[')
      throw std::runtime_error(file.string() +
                               ": is there already and is no JSON: it is not overwritten");
  }
  io::write_whole_file(file,
                       json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

fs::path traces_file(const fs::path& results) {
  if (io::is_special(results)) return "/dev/null";
  fs::path file = results;
  return file.replace_extension(".traces.json");
}

bool plot(const std::string& script, const std::vector<std::string>& arguments) {
  const auto path = plot_script(script);
  if (!path) {
    fmt::print(stderr, "plots: {} is not installed\n", script);
    return false;
  }

  std::vector<std::string> words{"/usr/bin/python3", path->string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  if (terminal::run_program(std::move(words)) != 0) {
    fmt::print(stderr, "plots: {} failed; the results themselves are complete\n", path->string());
    return false;
  }
  return true;
}

}  // namespace understory::eval::harness
