#include "common/bus/launch_config.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "common/bus/config_file.hpp"
#include "common/bus/config_layers.hpp"
#include "common/bus/parameter_table.hpp"

namespace understory::bus {
namespace {

constexpr std::array<std::string_view, 7> kProcessKeys{
    "name", "executable", "config", "arguments", "is_service", "keeps_state", "ends_last"};

/// The name is also the name of the process's state folder, which `--fresh` deletes: it must not
/// lead to another folder.
bool is_plain_name(std::string_view name) {
  return name.size() <= 64 && std::all_of(name.begin(), name.end(), [](char c) {
           const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
           return is_letter || (c >= '0' && c <= '9') || c == '_' || c == '-';
         });
}

class LaunchReader {
 public:
  /// `before`: the chain of files whose bases led here.
  explicit LaunchReader(std::filesystem::path file, std::vector<std::filesystem::path> before = {})
      : file_(std::move(file)), before_(std::move(before)) {}

  LaunchConfig read() {
    if (!std::filesystem::is_regular_file(file_)) {
      throw ConfigurationError({fmt::format("{}: no such file", file_.string())});
    }
    const toml::table root = parse_config(read_config_file(file_), file_.string());
    for (const auto& [key, node] : root) {
      if (key.str() != "process" && key.str() != kBaseKey) {
        fail(node,
             fmt::format("unknown key \"{}\"; allowed: {}, [[process]]", key.str(), kBaseKey));
      }
    }

    LaunchConfig config = inherited(root);
    const LaunchConfig own = stated(root);
    for (const ProcessEntry& entry : own.processes) {
      const auto same = std::ranges::find(config.processes, entry.name, &ProcessEntry::name);
      if (same != config.processes.end()) {
        *same = entry;
      } else {
        config.processes.push_back(entry);
      }
    }

    if (config.processes.empty()) {
      throw ConfigurationError({fmt::format("{}: no [[process]] in it", file_.string())});
    }
    return config;
  }

 private:
  [[noreturn]] void fail(const toml::node& node, const std::string& what) const {
    throw ConfigurationError(
        {fmt::format("{}:{}: {}", file_.string(), node.source().begin.line, what)});
  }

  /// The processes of the base, with the files of this folder in place of theirs.
  LaunchConfig inherited(const toml::table& root) const {
    const auto folder = base_of(root, file_.string());
    if (!folder) return {};
    const toml::node& key = *root.get(kBaseKey);
    const std::filesystem::path base = *folder / "launch.toml";
    std::vector<std::filesystem::path> files = before_;
    files.push_back(file_);
    if (const std::string cycle = cycle_in(files, base); !cycle.empty())
      fail(key, fmt::format("{}: {}", kBaseKey, cycle));
    if (!std::filesystem::is_regular_file(base))
      fail(key, fmt::format("{}: no file {}", kBaseKey, base.string()));

    LaunchConfig config = LaunchReader(base, files).read();
    for (ProcessEntry& entry : config.processes) {
      const std::filesystem::path own = file_.parent_path() / entry.config.filename();
      if (entry.config.empty() || !std::filesystem::is_regular_file(own)) continue;
      if (!parse_config(read_config_file(own), own.string()).contains(kBaseKey)) {
        throw ConfigurationError(
            {fmt::format("{}:1: {}: missing; state {} = \"{}\", or \"\" to take nothing from there",
                         own.string(), kBaseKey, kBaseKey,
                         entry.config.lexically_relative(own.parent_path()).string())});
      }
      entry.config = own;
    }
    return config;
  }

  /// The file's own processes.
  LaunchConfig stated(const toml::table& root) const {
    LaunchConfig config;
    const toml::node* const node = root.get("process");
    if (node == nullptr) return config;
    if (!node->is_array()) fail(*node, "\"process\" must be a list of tables: [[process]]");
    for (const auto& one : *node->as_array()) config.processes.push_back(process(one, config));
    return config;
  }

  ProcessEntry process(const toml::node& node, const LaunchConfig& before) const {
    const toml::table* table = node.as_table();
    if (table == nullptr) fail(node, "\"process\" must be a list of tables: [[process]]");

    for (const auto& [key, value] : *table) {
      if (std::find(kProcessKeys.begin(), kProcessKeys.end(), key.str()) == kProcessKeys.end()) {
        fail(value, fmt::format("unknown key \"{}\"; allowed: {}", key.str(),
                                fmt::join(kProcessKeys, ", ")));
      }
    }

    ProcessEntry entry;
    entry.name = text(*table, "name", true);
    if (!is_plain_name(entry.name)) {
      fail(*table->get("name"), "name: only letters, digits, _ and - are allowed, 64 at most");
    }
    entry.executable = text(*table, "executable", true);
    const std::filesystem::path config = text(*table, "config", false);
    if (!config.empty()) entry.config = file_.parent_path() / config;

    if (!entry.config.empty() && !std::filesystem::is_regular_file(entry.config)) {
      fail(*table->get("config"), fmt::format("config: no file {}", entry.config.string()));
    }

    entry.arguments = texts(*table, "arguments");
    entry.is_service = flag(*table, "is_service", entry.is_service);
    entry.keeps_state = flag(*table, "keeps_state", entry.is_service);
    entry.ends_last = flag(*table, "ends_last", entry.ends_last);

    for (const auto& other : before.processes) {
      if (other.name == entry.name)
        fail(node, fmt::format("name \"{}\" is there twice", entry.name));
    }

    return entry;
  }

  std::string text(const toml::table& table, std::string_view key, bool required) const {
    const toml::node* node = table.get(key);
    if (node == nullptr && required) fail(table, fmt::format("key \"{}\" is missing", key));
    if (node == nullptr) return {};
    if (!node->is_string() || node->as_string()->get().empty()) {
      fail(*node, fmt::format("{}: must be a text that is not empty", key));
    }
    return node->as_string()->get();
  }

  bool flag(const toml::table& table, const char* key, bool otherwise) const {
    const toml::node* const node = table.get(key);
    if (node == nullptr) return otherwise;
    if (!node->is_boolean()) fail(*node, fmt::format("{}: must be true or false", key));
    return *node->value<bool>();
  }

  std::vector<std::string> texts(const toml::table& table, std::string_view key) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) return {};
    if (!node->is_array()) fail(*node, fmt::format("{}: must be a list of texts", key));
    std::vector<std::string> result;
    for (const auto& item : *node->as_array()) {
      if (!item.is_string()) fail(item, fmt::format("{}: must be a list of texts", key));
      result.push_back(item.as_string()->get());
    }
    return result;
  }

  std::filesystem::path file_;
  std::vector<std::filesystem::path> before_;
};

}  // namespace

LaunchConfig read_launch_config(const std::filesystem::path& directory) {
  return LaunchReader(directory / "launch.toml").read();
}

std::filesystem::path config_file_in(const std::filesystem::path& directory,
                                     const std::string& process) {
  if (directory.empty()) return {};
  if (std::filesystem::is_regular_file(directory / "launch.toml")) {
    for (const ProcessEntry& entry : read_launch_config(directory).processes) {
      if (entry.name == process) return entry.config;
    }
  }

  const std::filesystem::path file = directory / (process + ".toml");
  return std::filesystem::exists(file) ? file : std::filesystem::path();
}

}  // namespace understory::bus
