#include "sfm/exchange/projections.hpp"

#include <iterator>
#include <utility>

#include <fmt/compile.h>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "sfm/exchange/colmap_model.hpp"
#include "sfm/exchange/text_reader.hpp"

namespace trigmesh {
namespace {

constexpr Eigen::Index kRows = 3;
constexpr Eigen::Index kColumns = 4;

/// Where the 12 numbers begin: after the blank that ends the name; npos when there are fewer
/// fields.
std::size_t begin_of_numbers(std::string_view line) {
  std::size_t position = line.find_last_not_of(" \t");
  for (Eigen::Index field = 0; field < kRows * kColumns; ++field) {
    if (position == line.npos || position == 0) {
      return line.npos;
    }
    position = line.find_last_of(" \t", position);
    if (field + 1 < kRows * kColumns && position != line.npos) {
      position = line.find_last_not_of(" \t", position);
    }
  }
  return position;
}

}  // namespace

Result<std::string> write_projections(const Scene& scene) {
  fmt::memory_buffer out;
  for (const View& view : scene.views) {
    if (!view.cam_from_world) {
      continue;
    }
    TM_RETURN_IF_ERROR(check_colmap_name(view.name));
    const Eigen::Matrix3d k = scene.cameras[index(view.camera)].calibration_matrix();
    const Eigen::Matrix<double, 3, 4> projection = k * view.cam_from_world->matrix();
    out.append(view.name.data(), view.name.data() + view.name.size());
    for (Eigen::Index row = 0; row < kRows; ++row) {
      for (Eigen::Index column = 0; column < kColumns; ++column) {
        fmt::format_to(std::back_inserter(out), FMT_COMPILE(" {}"), projection(row, column));
      }
    }
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

Result<std::vector<NamedProjection>> read_projections(std::string_view text) {
  TextReader reader(text, "projections.txt");
  std::vector<NamedProjection> projections;
  while (reader.next_record()) {
    NamedProjection entry;
    const std::size_t numbers = begin_of_numbers(reader.line());
    if (numbers == std::string_view::npos || numbers == 0) {
      reader.reject("a name and 12 numbers are expected");
      break;
    }
    entry.name = reader.line().substr(0, numbers);
    reader.go_to(numbers);
    for (Eigen::Index row = 0; row < kRows; ++row) {
      for (Eigen::Index column = 0; column < kColumns; ++column) {
        entry.projection(row, column) = reader.real("a number");
      }
    }
    projections.push_back(std::move(entry));
  }
  TM_RETURN_IF_ERROR(reader.status());
  return projections;
}

}  // namespace trigmesh
