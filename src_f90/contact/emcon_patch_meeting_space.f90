! build: elements
!> Where a node meets a surface of triangles, and where it is past an end of it.
!>
!> Source: docs/theory.md, section 14.
module emcon_patch_meeting_space
   use emcon_frame_vertex_space, only : frame_places
   use emcon_kinds, only : wp
   use emcon_patch_look_space, only : place_vertices
   use emcon_patch_moments_space, only : patch_moments
   use emcon_patch_sides_space, only : flip_signs, point_frames_t
   use emcon_patch_stencil_space, only : patch_stencil_t
   use emcon_polygon_clip_space, only : barycentric
   implicit none
   private
   public :: patch_meets

   !> A node is let go where less than this part of its patch is covered.
   real(wp), parameter, public :: least_cover = 0.02_wp
   !> At an outline of its side it is held if as much of the way to the middle of the faces there is
   !> over the surface itself.
   real(wp), parameter :: least_way = 1.0e-3_wp

contains

   !> Do the faces about the node of a frame come over the surface itself, not past its end over
   !> the flange? If the node is inside of them a part of its patch does, at their outline something
   !> of the way to their middle.
   pure logical function patch_meets(stencil, frames, frame, at, x, u0, du) result(meets)
      type(patch_stencil_t), intent(in) :: stencil   !! what its patch may see
      type(point_frames_t), intent(in) :: frames !! of the slave
      integer, intent(in) :: frame               !! 1 to the number of frames
      real(wp), intent(in) :: at(:, :)           !! (3, 3 + n_vertex) origin, frame, vertices [L]
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)  !! (3, n_node) [L]
      real(wp), intent(in), contiguous, optional :: du(:, :) !! at the end of this motion [L]
      real(wp) :: place(3, stencil%patch%n_vertex), middle(2), cover, way
      integer :: k

      associate (patch => stencil%patch, point => stencil%point)
         meets = all(point(:patch%n_vertex) > 0)
         if (meets) return
         call place_vertices(patch, at, place)
         middle = middle_of_faces(stencil, frames, frame, at, x, u0, du)
         cover = 0.0_wp
         way = 0.0_wp
         do k = 1, patch%n_triangle
            associate (t => patch%triangle(:, k), start => spread(patch%area%centre, 1, 2))
               if (any(point(t) <= 0)) cycle
               cover = cover + sum(patch_moments(patch%area, place(:2, t)))
               way = way + way_inside(barycentric(place(:2, t), start), &
                  barycentric(place(:2, t), middle))
            end associate
         end do
         if (maxval(abs(middle - patch%area%centre)) > 0.5_wp) then
            meets = way > least_way
         else
            meets = cover >= least_cover
         end if
      end associate
   end function patch_meets

   !> The middle of the faces about the node of a frame, in the coordinates of its patch.
   pure function middle_of_faces(stencil, frames, frame, at, x, u0, du) result(middle)
      type(patch_stencil_t), intent(in) :: stencil
      type(point_frames_t), intent(in) :: frames
      integer, intent(in) :: frame
      real(wp), intent(in) :: at(:, :)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp), intent(in), contiguous, optional :: du(:, :)
      real(wp) :: middle(2), mean(3, 1), place(3, 1)
      integer :: k

      associate (patch => stencil%patch)
         middle = patch%area%centre
         if (frames%point(frame) > frames%n_node) return
         mean = 0.0_wp
         associate (first => frames%ring_start(frame), last => frames%ring_start(frame + 1) - 1)
            do k = first, last
               mean(:, 1) = mean(:, 1) + flip_signs(frames%flip(k)) &
                  *(at_node(frames%ring(k)) - at_node(frames%base(frames%point(frame))))
            end do
            mean = mean/real(last - first + 1, wp)
         end associate
         call frame_places(at(:, 2) - at(:, 1), at(:, 3) - at(:, 1), mean, place)
         middle = middle + place(:2, 1)/patch%length
      end associate

   contains

      pure function at_node(node) result(y)
         integer, intent(in) :: node             !! of the scene
         real(wp) :: y(3)

         y = x(:, node) + u0(:, node)
         if (present(du)) y = y + du(:, node)
      end function at_node

   end function middle_of_faces

   !> The part of a way that is inside of a triangle, or on a side of it.
   pure real(wp) function way_inside(from, to)
      real(wp), intent(in) :: from(3), to(3)     !! barycentric coordinates of its ends
      real(wp) :: first, last
      integer :: k

      first = 0.0_wp
      last = 1.0_wp
      do k = 1, 3
         if (max(from(k), to(k)) < 0.0_wp) last = 0.0_wp
         if (from(k) < 0.0_wp .and. to(k) >= 0.0_wp) first = max(first, from(k)/(from(k) - to(k)))
         if (from(k) >= 0.0_wp .and. to(k) < 0.0_wp) last = min(last, from(k)/(from(k) - to(k)))
      end do
      way_inside = max(0.0_wp, last - first)
   end function way_inside

end module emcon_patch_meeting_space
