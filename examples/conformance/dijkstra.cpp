// A planner for `cgla conform` in C++17 without libraries: Dijkstra on a lattice of 48 directions.
//
//     g++ -O2 -std=c++17 -o dijkstra dijkstra.cpp
//     cgla conform -- ./dijkstra
//
// It reads a problem as JSON from standard input and writes a path as JSON to standard output. What any planner needs is
// in problem.hpp; put your own search in the place of `plan`. Docs: docs/conformance.md.

#include <functional>
#include <queue>

#include "problem.hpp"

// Points along the longer side; the longest step, in points.
const int POINTS = 161, REACH = 4;

// length + k * risk of a segment, by the midpoint rule on short parts: good enough to search with
double cost(const Map& map, Point a, Point b) {
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    const int parts = 1 + int(length / map.side * (POINTS - 1));
    double sum = 0.0;
    for (int i = 0; i < parts; ++i) {
        const double t = (i + 0.5) / parts;
        sum += map.risk({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
    }
    return length * (1.0 + map.k * sum / parts);
}

Path plan(const Map& map) {
    const double step = map.side / (POINTS - 1);
    // a lattice through the start, within the bounds; the goal is the last node
    const int low_i = int(std::ceil((map.x_min - map.start.x) / step)), low_j = int(std::ceil((map.y_min - map.start.y) / step));
    const int columns = int(std::floor((map.x_max - map.start.x) / step)) - low_i + 1;
    const int rows = int(std::floor((map.y_max - map.start.y) / step)) - low_j + 1;
    const int goal = columns * rows, source = -low_j * columns - low_i;
    auto place = [&](int node) {
        if (node == goal) return map.goal;
        return Point{map.start.x + (node % columns + low_i) * step, map.start.y + (node / columns + low_j) * step};
    };
    std::vector<std::pair<int, int>> moves;
    for (int i = -REACH; i <= REACH; ++i)
        for (int j = -REACH; j <= REACH; ++j) {
            int a = std::abs(i), b = std::abs(j);
            while (b) std::swap(a %= b, b);
            if (a == 1) moves.push_back({i, j});
        }
    std::vector<double> best(goal + 1, HUGE_VAL);
    std::vector<int> came(goal + 1, -1);
    using Entry = std::pair<double, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> queue;
    best[source] = 0.0;
    queue.push({0.0, source});
    while (!queue.empty()) {
        const auto [value, node] = queue.top();
        queue.pop();
        if (node == goal) break;
        if (value > best[node]) continue;
        const Point here = place(node);
        auto relax = [&](int other) {
            const Point there = place(other);
            const double length = std::hypot(there.x - here.x, there.y - here.y);
            // no segment costs less than its length
            if (best[node] + length >= best[other] || map.crosses(here, there)) return;
            const double value = best[node] + cost(map, here, there);
            if (value < best[other]) {
                best[other] = value;
                came[other] = node;
                queue.push({value, other});
            }
        };
        for (const auto& [i, j] : moves) {
            const int x = node % columns + i, y = node / columns + j;
            if (x >= 0 && x < columns && y >= 0 && y < rows) relax(y * columns + x);
        }
        if (std::hypot(map.goal.x - here.x, map.goal.y - here.y) <= REACH * step) relax(goal);
    }
    Path path;
    if (best[goal] < HUGE_VAL)
        for (int node = goal; node >= 0; node = came[node]) path.push_back(place(node));
    std::reverse(path.begin(), path.end());
    return path;
}

int main() {
    try {
        answer(plan(read_problem()));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "no problem that can be read: %s\n", error.what());
        return 1;
    }
}
