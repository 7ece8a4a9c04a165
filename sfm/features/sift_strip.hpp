#pragma once

#include <array>
#include <functional>
#include <vector>

#include "sfm/features/sift_rows.hpp"
#include "sfm/features/sift_scale_space.hpp"

namespace trigmesh::sift {

/// The kernels that lead from one level of an octave to the next.
struct OctaveKernels {
  OctaveKernels();

  /// From the input image to level 0; the input is taken to have a blur of `input_sigma` px.
  [[nodiscard]] static GaussianKernel to_base(double input_sigma);

  std::array<GaussianKernel, kLevels> to_level;  ///< [0] is empty
};

/// Writes the source pixels (x .. x + count - 1, y) as grey values.
using RowSource = std::function<void(int y, int x, int count, float* out)>;

/// One octave to be worked through. All pointers are lent for the time of the call.
struct OctaveJob {
  int index = 0;
  RowSource source;
  const GaussianKernel* to_base = nullptr;  ///< null: the source is level 0 already
  Octave* octave = nullptr;                 ///< levels are written here
  float* next_base = nullptr;  ///< level kScalesPerOctave, every second pixel and row; may be null
  int next_width = 0;
};

/// Runs a vertical strip of one octave from source rows to levels and extrema. All blurs advance
/// together, a few rows at a time, with only the rows in memory that a later blur or the search
/// still needs.
class StripPass {
 public:
  /// Columns [begin, end) of the octave are the result of this strip. `memory` is scratch, grown
  /// when needed.
  StripPass(const OctaveKernels& kernels,
            const OctaveJob& job,
            const ScaleSpaceOptions& options,
            std::vector<float>& memory);

  void run(int begin, int end, std::vector<Extremum>& extrema);

  /// Columns beside a strip whose blurs and search reach into it.
  [[nodiscard]] static int halo(const OctaveKernels& kernels, const OctaveJob& job);

 private:
  /// The last `capacity` rows of an image.
  struct RowRing {
    float* data = nullptr;
    int capacity = 1;
    std::ptrdiff_t stride = 0;

    [[nodiscard]] float* row(int y) const { return data + (y % capacity) * stride; }
  };

  void allocate();
  void fetch_until(RowRing& ring, int& next_row, int last_row);
  void produce(int level);
  void produce_base();
  void blur_block(const GaussianKernel& kernel, const RowRing& from, int first_row);
  void finish_row(int level, int y);
  void search_until(int last_row);
  void search_row(int layer, int y);
  [[nodiscard]] Neighbourhood neighbourhood(int layer, int y) const;
  void refine(int layer, int y, int x);

  const OctaveKernels& kernels_;
  const OctaveJob& job_;
  const ScaleSpaceOptions& options_;
  std::vector<float>& memory_;
  std::vector<Extremum>* extrema_ = nullptr;
  std::vector<int> columns_;

  int width_ = 0;   ///< of the octave
  int height_ = 0;  ///< of the octave
  int begin_ = 0;   ///< first column of the result
  int end_ = 0;
  int left_ = 0;   ///< octave column of strip column 0
  int count_ = 0;  ///< strip columns with the halo

  RowRing input_;
  std::array<RowRing, kLevels> levels_;  ///< the last is not needed again and holds one block
  std::array<RowRing, kDifferences> differences_;
  std::array<float*, kRowsAtOnce> columns_done_{};  ///< rows after the vertical pass
  int next_input_row_ = 0;
  std::array<int, kLevels> next_row_{};
  int next_search_row_ = 0;
};

}  // namespace trigmesh::sift
