!> Which facets mortar integrates over where a surface in space is in contact with itself: of two
!> facets that meet one is the slave, and it looks at the bodies of each class by itself.
!>
!> Between bodies the one with the shorter facets is the slave; within a body what comes first along
!> a direction that is none of a mesh. So a part of the surface that meets another one is the slave
!> as a whole. Source: docs/theory.md, section 14.2.
module emcon_mortar_itself_space
   use emcon_facets, only : facets_join_nodes, facets_length, facets_t
   use emcon_kinds, only : wp
   use emcon_touch_rule_space, only : touch_rule_space_meet, touch_rule_space_sees, &
      touch_rule_space_t
   implicit none
   private
   public :: mortar_itself_t, mortar_itself_init, mortar_itself_meets, mortar_itself_facet

   !> Along what facets of a body are in turn.
   real(wp), parameter :: direction(3) = [0.5411961_wp, 0.6180340_wp, 0.5698403_wp]
   !> Facets are as long if they differ by less than this part.
   real(wp), parameter :: as_long = 1.0e-9_wp

   type :: mortar_itself_t
      integer :: n_facet = 0                     !! of the surface; 0: two surfaces meet
      real(wp), allocatable :: length(:)         !! (n_facet) mean of the facets of its body [L]
      real(wp), allocatable :: place(:)          !! (n_facet) along the direction [L]
   end type mortar_itself_t

contains

   !> Set up for the facets of a surface, which become as many copies of them on the same nodes as
   !> there are classes of bodies: one for each class that it looks at.
   pure subroutine mortar_itself_init(self, facets, rule, x)
      type(mortar_itself_t), intent(out) :: self
      type(facets_t), intent(inout) :: facets    !! in space
      type(touch_rule_space_t), intent(in) :: rule   !! for them
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      integer :: f, n
      real(wp) :: total(maxval(rule%body)), number(maxval(rule%body))

      n = facets%n_facet
      self%n_facet = n
      allocate(self%place(n))
      total = 0.0_wp
      number = 0.0_wp
      do f = 1, n
         associate (node => pack(facets%facet(:, f), facets%facet(:, f) > 0), body => rule%body(f))
            self%place(f) = dot_product(direction, sum(x(:, node), 2))/real(size(node), wp)
            total(body) = total(body) + facets_length(facets, f)
            number(body) = number(body) + 1.0_wp
         end associate
      end do
      self%length = total(rule%body)/number(rule%body)
      call repeat_facets(facets, rule%n_class)
   end subroutine mortar_itself_init

   !> Make copies of facets on the same nodes, of which none is beside another one.
   pure subroutine repeat_facets(facets, n_copy)
      type(facets_t), intent(inout) :: facets
      integer, intent(in) :: n_copy
      type(facets_t) :: one
      integer :: k

      one = facets
      do k = 1, n_copy - 1
         associate (n => facets%n_facet)
            facets%facet = reshape([facets%facet, one%facet], [size(one%facet, 1), n + one%n_facet])
            facets%corner = reshape([facets%corner, one%corner], &
               [size(one%corner, 1), n + one%n_facet])
            facets%neighbour = reshape([facets%neighbour, merge(one%neighbour + n, 0, &
               one%neighbour > 0)], [size(one%neighbour, 1), n + one%n_facet])
            facets%part = [facets%part, one%part + n]
            facets%size = [facets%size, one%size]
            facets%element = [facets%element, one%element]
            facets%face = [facets%face, one%face]
         end associate
         facets%n_facet = facets%n_facet + one%n_facet
      end do
      deallocate(facets%around_start, facets%around)
      call facets_join_nodes(facets)
   end subroutine repeat_facets

   !> The facet of the surface that a copy is of.
   elemental integer function mortar_itself_facet(self, copy) result(f)
      type(mortar_itself_t), intent(in) :: self
      integer, intent(in) :: copy                !! >= 1

      f = 1 + mod(copy - 1, self%n_facet)
   end function mortar_itself_facet

   !> May a copy, as a slave, ever meet facet `g`?
   pure logical function mortar_itself_meets(self, rule, facets, copy, g) result(meets)
      type(mortar_itself_t), intent(in) :: self
      type(touch_rule_space_t), intent(in) :: rule
      type(facets_t), intent(in) :: facets       !! that the rule is for
      integer, intent(in) :: copy                !! >= 1
      integer, intent(in) :: g                   !! 1 to n_facet

      associate (f => mortar_itself_facet(self, copy))
         meets = touch_rule_space_sees(rule, 1 + (copy - 1)/self%n_facet, g)
         if (meets) meets = is_slave(self, rule, f, g)
         if (meets) meets = touch_rule_space_meet(rule, facets, f, g)
      end associate
   end function mortar_itself_meets

   !> Is facet `f` the slave, `g` the master?
   pure logical function is_slave(self, rule, f, g)
      type(mortar_itself_t), intent(in) :: self
      type(touch_rule_space_t), intent(in) :: rule
      integer, intent(in) :: f, g

      if (rule%body(f) == rule%body(g)) then
         is_slave = self%place(f) < self%place(g)
         if (abs(self%place(f) - self%place(g)) <= 0.0_wp) is_slave = f < g
      else
         is_slave = self%length(f) < self%length(g)
         if (abs(self%length(f) - self%length(g)) <= as_long*self%length(f)) then
            is_slave = rule%body(f) < rule%body(g)
         end if
      end if
   end function is_slave

end module emcon_mortar_itself_space
