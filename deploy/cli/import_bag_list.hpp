// What a bag holds, for people.
#pragma once

#include "common/bag/survey.hpp"
#include "deploy/cli/import_bag_choice.hpp"
#include "deploy/cli/import_bag_mounts.hpp"

namespace understory::cli {

/// Prints topics, types, counts, rates, frames, clocks, what each becomes, and the mounts.
void print_bag_list(const std::string& path, const bag::Bag& bag, const bag::Survey& survey,
                    const BagTopics& named, const BagMounts& mounts);

/// Topics whose clocks differ from the others' by more than 0.5 s: one line for each, with the
/// option that mends it. Of `chosen` topics.
std::vector<std::string> clock_remarks(const bag::Bag& bag, const bag::Survey& survey,
                                       const std::vector<std::size_t>& chosen);

}  // namespace understory::cli
