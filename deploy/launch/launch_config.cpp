#include "deploy/launch/launch_config.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace understory::launch {
namespace {

constexpr std::array<std::string_view, 5> kProcessKeys{"name", "executable", "config", "arguments",
                                                       "keeps_state"};

/// A name is also that of the folder of the process's state, which `--fresh` deletes: it must not
/// lead elsewhere.
bool is_plain_name(std::string_view name) {
  return name.size() <= 64 && std::all_of(name.begin(), name.end(), [](char c) {
           const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
           return is_letter || (c >= '0' && c <= '9') || c == '_' || c == '-';
         });
}

class Reader {
 public:
  explicit Reader(std::filesystem::path file) : file_(std::move(file)) {}

  LaunchConfig read() {
    const toml::table root = parse();
    for (const auto& [key, node] : root) {
      if (key.str() != "process") {
        fail(node, fmt::format("unknown key \"{}\"; allowed: [[process]]", key.str()));
      }
    }

    const toml::array* processes = root["process"].as_array();
    if (processes == nullptr || processes->empty()) {
      throw ConfigError(fmt::format("{}: no [[process]] in it", file_.string()));
    }

    LaunchConfig config;
    for (const auto& node : *processes) config.processes.push_back(process(node, config));

    return config;
  }

 private:
  [[noreturn]] void fail(const toml::node& node, const std::string& what) const {
    throw ConfigError(fmt::format("{}:{}: {}", file_.string(), node.source().begin.line, what));
  }

  toml::table parse() const {
    if (!std::filesystem::is_regular_file(file_)) {
      throw ConfigError(fmt::format("{}: no such file", file_.string()));
    }
    try {
      return toml::parse_file(file_.string());
    } catch (const toml::parse_error& error) {
      throw ConfigError(
          fmt::format("{}:{}: {}", file_.string(), error.source().begin.line, error.description()));
    }
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
    if (const toml::node* keeps = table->get("keeps_state")) {
      if (!keeps->is_boolean()) fail(*keeps, "keeps_state: must be true or false");
      entry.keeps_state = *keeps->value<bool>();
    }

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
};

}  // namespace

LaunchConfig read_launch_config(const std::filesystem::path& directory) {
  return Reader(directory / "launch.toml").read();
}

}  // namespace understory::launch
