// Owning handles of PROJ. Only for the sources of this folder.
#pragma once

#include <proj.h>

#include <Eigen/Core>
#include <memory>
#include <string>

namespace understory::reference_system {

/// Deleter of PROJ's objects.
struct ProjRelease {
  /// Ends a thread's context.
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
  /// Ends a system or an operation.
  void operator()(PJ* object) const { proj_destroy(object); }
};
/// A thread's context of PROJ.
using ContextHandle = std::unique_ptr<PJ_CONTEXT, ProjRelease>;
/// A system or an operation.
using ProjHandle = std::unique_ptr<PJ, ProjRelease>;

/// A context without output and without network access.
ContextHandle new_context();
/// A horizontal system by a name as for summary_of(). Throws ReferenceError.
ProjHandle horizontal_system(PJ_CONTEXT* context, const std::string& text);
/// The registry's code of a system, else its name.
std::string code_of(PJ* system);
/// The operation between two systems, first coordinate east. Throws ReferenceError.
ProjHandle operation_between(PJ_CONTEXT* context, PJ* from, PJ* to, PJ_AREA* area);
/// Applies an operation to coordinates. Throws ReferenceError.
Eigen::Vector2d passed(PJ* operation, PJ_DIRECTION direction, const Eigen::Vector2d& at);

}  // namespace understory::reference_system
