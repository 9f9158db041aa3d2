// The muscle: a plane spindle of half length 0.1 m and half height
// 0.012 + 0.018 cos^2(pi x / 0.2) m, with the groups that the scenes need.
//
//     gmsh -2 -format msh41 muscle.geo
//
// makes a mesh like muscle.msh (not the same: that depends on Gmsh's version).

half_length = 0.1;
half_load = 0.02;     // the load acts on the top where |x| <= half_load
size = DefineNumber[0.01, Name "Element size (m)"];
pieces = 7;           // straight pieces of the outline from an end to the load, and to the middle
load_pieces = 4;

Macro Height
  h = 0.012 + 0.018 * Cos(Pi * x / (2 * half_length))^2;
Return

// Vertices of the top from right to left: right side, load, left side.
top[] = {};
For i In {0 : pieces}
  x = half_length - (half_length - half_load) * i / pieces; Call Height;
  top[] += newp; Point(top[#top[] - 1]) = {x, h, 0, size};
EndFor
start_load = #top[] - 1;
For i In {1 : load_pieces}
  x = half_load - 2 * half_load * i / load_pieces; Call Height;
  top[] += newp; Point(top[#top[] - 1]) = {x, h, 0, size};
EndFor
end_load = #top[] - 1;
For i In {1 : pieces}
  x = -half_load - (half_length - half_load) * i / pieces; Call Height;
  top[] += newp; Point(top[#top[] - 1]) = {x, h, 0, size};
EndFor

// Vertices of the bottom from left to right.
bottom[] = {};
For i In {0 : 2 * pieces}
  x = -half_length + half_length * i / pieces; Call Height;
  bottom[] += newp; Point(bottom[#bottom[] - 1]) = {x, -h, 0, size};
EndFor

free[] = {};
load[] = {};
For i In {0 : #top[] - 2}
  line = newl; Line(line) = {top[i], top[i + 1]};
  If (i >= start_load && i < end_load)
    load[] += line;
  Else
    free[] += line;
  EndIf
  If (i == 0)
    loop[] = {line};
  Else
    loop[] += line;
  EndIf
EndFor
left = newl; Line(left) = {top[#top[] - 1], bottom[0]};
loop[] += left;
For i In {0 : #bottom[] - 2}
  line = newl; Line(line) = {bottom[i], bottom[i + 1]};
  free[] += line;
  loop[] += line;
EndFor
right = newl; Line(right) = {bottom[#bottom[] - 1], top[0]};
loop[] += right;

Curve Loop(1) = {loop[]};
Plane Surface(1) = {1};

// The probe's vertex.
origin = newp; Point(origin) = {0, 0, 0, size};
Point{origin} In Surface{1};

Physical Point("origin") = {origin};
Physical Curve("fixed") = {left, right};
Physical Curve("load") = {load[]};
Physical Surface("muscle") = {1};

// Triangles of order 1, ASCII, format 4.1: what the reader takes.
Mesh.ElementOrder = 1;
Mesh.Binary = 0;
Mesh.MshFileVersion = 4.1;
