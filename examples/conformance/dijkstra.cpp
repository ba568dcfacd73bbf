// A planner for `cgla conform`, in one file of C++17 without libraries: Dijkstra on a lattice of 48 directions.
//
//     g++ -O2 -std=c++17 -o dijkstra dijkstra.cpp
//     cgla conform -- ./dijkstra
//
// It reads a problem as JSON from standard input and writes a path as JSON to standard output. Docs: docs/conformance.md.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <map>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// Points along the longer side; the longest step, in points.
const int POINTS = 161, REACH = 4;
// Closer to an edge than this part of the longer side counts as crossing it: the oracle has no tolerance.
const double NEAR = 1e-9;

// ---- as much of JSON as a problem has ----

struct Json {
    double number = 0.0;
    std::string text;
    std::vector<Json> items;
    std::map<std::string, Json> keys;
    const Json& operator[](const std::string& key) const { return keys.at(key); }
    const Json& operator[](size_t i) const { return items.at(i); }
};

struct Reader {
    const char* at;
    void blanks() { while (*at == ' ' || *at == '\n' || *at == '\r' || *at == '\t') ++at; }
    bool take(char c) { blanks(); if (*at != c) return false; ++at; return true; }
    std::string string() {
        std::string out;
        if (!take('"')) throw std::runtime_error("a string is missing");
        while (*at && *at != '"') { if (*at == '\\') ++at; out += *at++; }
        ++at;
        return out;
    }
    Json value() {
        Json out;
        blanks();
        if (*at == '"') {
            out.text = string();
        } else if (take('[')) {
            if (take(']')) return out;
            do out.items.push_back(value()); while (take(','));
            if (!take(']')) throw std::runtime_error("a ] is missing");
        } else if (take('{')) {
            if (take('}')) return out;
            do { std::string key = string(); take(':'); out.keys[key] = value(); } while (take(','));
            if (!take('}')) throw std::runtime_error("a } is missing");
        } else if (*at == 'n' || *at == 't') {
            at += 4;
        } else if (*at == 'f') {
            at += 5;
        } else {
            char* end;
            out.number = std::strtod(at, &end);
            if (end == at) throw std::runtime_error("a value is missing");
            at = end;
        }
        return out;
    }
};

// ---- what a path costs, and where it may not go ----

struct Point { double x, y; };
struct Threat { double x, y, spread, peak; };
struct Raster { double x_min, y_min, x_max, y_max; bool nearest; std::vector<std::vector<double>> values; };

double between(double low, double x, double high) { return std::min(std::max(x, low), high); }

double risk_of(const Raster& raster, Point p) {
    if (p.x < raster.x_min || p.x > raster.x_max || p.y < raster.y_min || p.y > raster.y_max) return 0.0;
    const auto& v = raster.values;  // rows begin at y_min
    const int rows = int(v.size()), columns = int(v[0].size());
    double across = (p.x - raster.x_min) / (raster.x_max - raster.x_min) * columns;
    double up = (p.y - raster.y_min) / (raster.y_max - raster.y_min) * rows;
    if (raster.nearest) return v[std::min(int(up), rows - 1)][std::min(int(across), columns - 1)];
    across = between(0.0, across - 0.5, columns - 1.0);
    up = between(0.0, up - 0.5, rows - 1.0);
    const int i = int(across), j = int(up), right = std::min(i + 1, columns - 1), above = std::min(j + 1, rows - 1);
    const double a = across - i, b = up - j;
    return (v[j][i] * (1 - a) + v[j][right] * a) * (1 - b) + (v[above][i] * (1 - a) + v[above][right] * a) * b;
}

struct Map {
    double x_min, y_min, x_max, y_max, side, k;
    Point start, goal;
    std::vector<Threat> threats;
    std::vector<Raster> rasters;
    // each edge of each ring; holes are rings like any other: what is inside of an odd number of them is closed
    std::vector<std::pair<Point, Point>> edges;

    explicit Map(const Json& problem) {
        const Json& b = problem["bounds"];
        x_min = b[0].number, y_min = b[1].number, x_max = b[2].number, y_max = b[3].number;
        side = std::max(x_max - x_min, y_max - y_min);
        k = problem["k"].number;
        start = {problem["start"][0].number, problem["start"][1].number};
        goal = {problem["goal"][0].number, problem["goal"][1].number};
        for (const Json& t : problem["threats"].items)
            threats.push_back({t["x"].number, t["y"].number, t["spread"].number, t["peak"].number});
        for (const Json& r : problem["rasters"].items) {
            const Json& c = r["bounds"];
            Raster raster{c[0].number, c[1].number, c[2].number, c[3].number, r["interpolation"].text == "nearest", {}};
            for (const Json& row : r["values"].items) {
                raster.values.emplace_back();
                for (const Json& value : row.items) raster.values.back().push_back(value.number);
            }
            rasters.push_back(raster);
        }
        for (const Json& polygon : problem["no_fly"].items)
            for (const Json& ring : polygon.items)
                for (size_t i = 0, n = ring.items.size(); i < n; ++i) {
                    const Json &a = ring[i], &e = ring[(i + 1) % n];
                    edges.push_back({{a[0].number, a[1].number}, {e[0].number, e[1].number}});
                }
    }

    double risk(Point p) const {
        double spared = 1.0, sum = 0.0;
        for (const Threat& t : threats) {
            const double squared = (p.x - t.x) * (p.x - t.x) + (p.y - t.y) * (p.y - t.y);
            spared *= 1.0 - t.peak * std::exp(-squared / (2.0 * t.spread * t.spread));
        }
        for (const Raster& raster : rasters) sum += risk_of(raster, p);
        return 1.0 - spared + sum;
    }

    // length + k * risk of a segment, by the midpoint rule on short parts: good enough to search with
    double cost(Point a, Point b) const {
        const double length = std::hypot(b.x - a.x, b.y - a.y);
        const int parts = 1 + int(length / side * (POINTS - 1));
        double sum = 0.0;
        for (int i = 0; i < parts; ++i) {
            const double t = (i + 0.5) / parts;
            sum += risk({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
        }
        return length * (1.0 + k * sum / parts);
    }

    // inside a no-fly area, or almost on its edge
    bool is_closed(Point p) const {
        bool inside = false;
        for (const auto& [a, b] : edges) {
            const double dx = b.x - a.x, dy = b.y - a.y;
            const double t = between(0.0, ((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy), 1.0);
            if (std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy) < NEAR * side) return true;
            if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) * dx / dy) inside = !inside;
        }
        return inside;
    }

    // cut a segment at all edges, and look at the middle of each part
    bool crosses(Point p, Point q) const {
        std::vector<double> cuts = {0.0, 1.0};
        const double px = q.x - p.x, py = q.y - p.y;
        for (const auto& [a, b] : edges) {
            if (std::max(a.x, b.x) < std::min(p.x, q.x) || std::max(p.x, q.x) < std::min(a.x, b.x)) continue;
            if (std::max(a.y, b.y) < std::min(p.y, q.y) || std::max(p.y, q.y) < std::min(a.y, b.y)) continue;
            const double dx = b.x - a.x, dy = b.y - a.y, turn = px * dy - py * dx;
            if (turn == 0.0) continue;
            const double along = ((a.x - p.x) * dy - (a.y - p.y) * dx) / turn;
            const double across = ((a.x - p.x) * py - (a.y - p.y) * px) / turn;
            if (along > 0.0 && along < 1.0 && across >= -NEAR && across <= 1.0 + NEAR) cuts.push_back(along);
        }
        std::sort(cuts.begin(), cuts.end());
        for (size_t i = 0; i + 1 < cuts.size(); ++i) {
            const double t = 0.5 * (cuts[i] + cuts[i + 1]);
            if (is_closed({p.x + t * px, p.y + t * py})) return true;
        }
        return false;
    }
};

// ---- the search ----

std::vector<Point> plan(const Map& map) {
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
            const double cost = best[node] + map.cost(here, there);
            if (cost < best[other]) {
                best[other] = cost;
                came[other] = node;
                queue.push({cost, other});
            }
        };
        for (const auto& [i, j] : moves) {
            const int x = node % columns + i, y = node / columns + j;
            if (x >= 0 && x < columns && y >= 0 && y < rows) relax(y * columns + x);
        }
        if (std::hypot(map.goal.x - here.x, map.goal.y - here.y) <= REACH * step) relax(goal);
    }
    std::vector<Point> path;
    if (best[goal] < HUGE_VAL)
        for (int node = goal; node >= 0; node = came[node]) path.push_back(place(node));
    std::reverse(path.begin(), path.end());
    return path;
}

int main() {
    try {
        const std::string text((std::istreambuf_iterator<char>(std::cin)), std::istreambuf_iterator<char>());
        const std::vector<Point> path = plan(Map(Reader{text.c_str()}.value()));
        if (path.empty()) {
            std::puts("{\"path\": null}");
            return 0;
        }
        // 17 digits: a number comes back as it was
        for (size_t i = 0; i < path.size(); ++i)
            std::printf("%s[%.17g, %.17g]", i ? ", " : "{\"path\": [", path[i].x, path[i].y);
        std::puts("]}");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "no problem that can be read: %s\n", error.what());
        return 1;
    }
}
