#include "common/bus/config_layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "common/bus/config_file.hpp"
#include "common/bus/parameter_table.hpp"

namespace understory::bus {
namespace {

std::filesystem::path resolved(const std::filesystem::path& file) {
  std::error_code ignored;
  const auto path = std::filesystem::weakly_canonical(file, ignored);
  return path.empty() ? file : path;
}

}  // namespace

std::string cycle_in(const std::vector<std::filesystem::path>& files,
                     const std::filesystem::path& next) {
  const auto is_next = [&](const auto& file) { return resolved(file) == resolved(next); };
  if (std::none_of(files.begin(), files.end(), is_next)) return {};
  std::string way;
  for (const auto& file : files) way += file.string() + " -> ";
  return fmt::format("leads back: {}{}", way, next.string());
}

std::optional<std::filesystem::path> base_of(const toml::table& table, const std::string& name) {
  const toml::node* const node = table.get(kBaseKey);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) {
    throw ConfigurationError({fmt::format("{}:{}: {}: must be a path in quotes", name,
                                          node->source().begin.line, kBaseKey)});
  }
  const std::string& base = node->as_string()->get();
  if (base.empty()) return std::nullopt;
  return (std::filesystem::path(name).parent_path() / base).lexically_normal();
}

toml::table parse_config(std::string_view toml, const std::string& name) {
  try {
    return toml::parse(toml, name);
  } catch (const toml::parse_error& error) {
    throw ConfigurationError(
        {fmt::format("{}:{}: {}", name, error.source().begin.line, error.description())});
  }
}

std::vector<ConfigLayer> config_layers(std::string_view toml, const std::string& name) {
  // Moved, never copied: a copy of a table loses its line numbers.
  std::vector<ConfigLayer> layers;
  layers.push_back({name, parse_config(toml, name)});
  std::vector<std::filesystem::path> files{name};

  while (const auto base = base_of(layers.back().table, layers.back().name)) {
    const toml::node& key = *layers.back().table.get(kBaseKey);
    const auto refuse = [&](const std::string& what) {
      throw ConfigurationError({fmt::format("{}:{}: {}: {}", layers.back().name,
                                            key.source().begin.line, kBaseKey, what)});
    };
    if (const std::string cycle = cycle_in(files, *base); !cycle.empty()) refuse(cycle);
    if (!std::filesystem::is_regular_file(*base)) refuse("no file " + base->string());
    files.push_back(*base);
    layers.push_back({base->string(), parse_config(read_config_file(*base), base->string())});
  }

  std::reverse(layers.begin(), layers.end());
  return layers;
}

std::string layer_over(const std::filesystem::path& base, const toml::table& values) {
  toml::table layer = values;
  if (!base.empty()) layer.insert_or_assign(kBaseKey, std::filesystem::absolute(base).string());
  std::ostringstream text;
  text << layer << '\n';
  return text.str();
}

}  // namespace understory::bus
